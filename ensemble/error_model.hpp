#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace cohort {

/// The error of a feature f(h) from f(h/2): Richardson's estimate 2^p / (2^p - 1) (f(h) - f(h/2)), p being
/// `order`. L. F. Richardson, Phil. Trans. R. Soc. A 210 (1911) 307-357.
double error_of(double coarse, double fine, double order);

/// How the errors of a feature depend on the parameters. The numbers stand in /errors/model.
enum class ErrorModelKind : std::uint8_t { none, constant, linear };
inline constexpr std::array<const char*, 3> error_model_names{"none", "constant", "linear"};

/// The error of one feature over the unit cube of the parameters, learned from the members that were checked:
/// none below two of them; a constant, their mean; or a plane by ridge regression (A. E. Hoerl, R. W.
/// Kennard, Technometrics 12 (1970) 55-67), which takes ten checks and two more than twice the parameters.
/// Each check is told from all the others, and the plane is taken where it does that better than the constant
/// by more than chance: its mean gain of squares is above 1.5 of its standard errors and above a fifth. The
/// strength of the ridge is one of three, likewise.
class ErrorModel {
 public:
  /// `points` (n, P) row-major, `errors` (n), finite.
  ErrorModel(std::span<const double> points, std::size_t parameters, std::span<const double> errors);

  ErrorModelKind kind() const { return kind_; }
  /// The error at `point` (P); NaN for kind none. Never beyond the errors that were seen by more than a
  /// quarter of their range.
  double at(std::span<const double> point) const;
  /// Root mean square of what is missed where each check is told from the others (Allen's PRESS): by this
  /// model, and by the constant. NaN for kind none.
  double left_out_rms() const { return left_out_rms_; }
  double left_out_rms_constant() const { return left_out_rms_constant_; }

 private:
  ErrorModelKind kind_ = ErrorModelKind::none;
  double mean_, lowest_, highest_, left_out_rms_, left_out_rms_constant_;
  std::vector<double> centre_, slopes_;
};

}  // namespace cohort
