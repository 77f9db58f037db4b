#pragma once

namespace cohort {

/// The k for which mean - k s to mean + k s of n >= 2 numbers holds a share `content` of the normal
/// distribution that they are drawn from, with probability `confidence`; exact. k is the root of
/// sqrt(2 n / pi) integral_0^inf P(chi^2_{n-1} > (n - 1) r(x)^2 / k^2) exp(-n x^2 / 2) dx = confidence, where
/// r(x) is half the width of the interval around x that holds `content` of the standard normal distribution.
/// A. Wald, J. Wolfowitz, Ann. Math. Stat. 17 (1946) 208-215; K. Krishnamoorthy, T. Mathew, Statistical
/// Tolerance Regions (2009), (2.3.5).
double tolerance_factor(int n, double content, double confidence);

}  // namespace cohort
