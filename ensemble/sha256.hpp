#pragma once

#include <string>
#include <string_view>

namespace cohort {

/// SHA-256 of `message` (FIPS 180-4) as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view message);

}  // namespace cohort
