#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Declares circulation.* and the numbers of the beat: time.beats.* where the scene has beats, else
/// time.beat_ms where a circulation has a period. Throws std::invalid_argument for beats without a
/// circulation.
void declare_circulation(Scene& scene);

/// Period of the heart (ms); needs a circulation.
double beat_ms(const Scene& scene);

/// Most beats of a member: time.beats.at_most, or as many as time.end_ms begins.
int most_beats(const Scene& scene);

/// Whether a chamber is a cavity of the scene's mechanics.
bool is_tissue(const Scene& scene, Chamber chamber);

/// Why a member's numbers make no circulation (a contraction longer than the beat, a valve that is tighter
/// open than closed); empty where they do.
std::string circulation_defect(const Scene& scene, std::span<const double> values);

/// Room on the device for one member's state: HEART_STATE_BYTES of kernels/beats.clh.
inline constexpr std::size_t heart_state_bytes = 1024;

/// Generated text that kernels/circulation.clh needs, with its options as #define: the places of numbers in a
/// member's block. single: of a device without double precision.
std::string circulation_tables(const Scene& scene, bool single);

}  // namespace cohort
