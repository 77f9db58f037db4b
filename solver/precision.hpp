#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

inline std::size_t real_bytes(Precision precision) {
  return precision == Precision::double_ ? 8 : 4;
}

/// `numbers` as the device's reals, for a buffer.
inline std::vector<std::byte> pack(std::span<const double> numbers, Precision precision) {
  std::vector<std::byte> bytes(numbers.size() * real_bytes(precision));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (precision == Precision::double_)
      reinterpret_cast<double*>(bytes.data())[i] = numbers[i];
    else
      reinterpret_cast<float*>(bytes.data())[i] = static_cast<float>(numbers[i]);
  }
  return bytes;
}

/// The inverse of pack().
inline std::vector<double> unpack(std::span<const std::byte> bytes, Precision precision) {
  std::vector<double> numbers(bytes.size() / real_bytes(precision));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    numbers[i] = precision == Precision::double_ ? reinterpret_cast<const double*>(bytes.data())[i]
                                                 : reinterpret_cast<const float*>(bytes.data())[i];
  }
  return numbers;
}

}  // namespace cohort
