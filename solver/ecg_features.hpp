#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace cohort {

/// Names and units of what ecg_features() measures, in its order: intervals, onsets and ends (ms), axes
/// (degrees in the frontal plane, 0 to the left, 90 down), R, S and the time of the R peak after QRS onset in
/// V1 to V6, T in every lead. Amplitudes are signed, in mV, against the potential just before QRS.
std::vector<std::pair<std::string, std::string>> ecg_feature_names();

/// Measures one beat. ecg: (12, samples) mV, row-major, I II III aVR aVL aVF V1 ... V6. What is not there, or
/// not within the series, is NaN; intervals are not corrected for heart rate.
///
/// QRS: where the spatial velocity, the norm of d/dt of I, II, V1 ... V6, about its largest value exceeds
/// 0.005 mV/ms; P: 0.001 mV/ms before QRS. An absolute threshold, since one relative to the peak moves with
/// the sharpness of the front. With noise (told from second differences) the series are smoothed by a
/// Gaussian of 2.5 ms and thresholds rise to what the quiet parts exceed rarely. The end of T is where the
/// steepest tangent behind its peak meets the baseline (Lepeschkin & Surawicz, Circulation 6 (1952) 378), the
/// median over the leads whose T is large enough. Of a QRS or T that the series ends before nothing is told
/// but where QRS begins.
std::vector<float> ecg_features(std::span<const float> ecg, double interval_ms);

}  // namespace cohort
