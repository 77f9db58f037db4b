#pragma once

#include <string>
#include <vector>

#include "solver/cell_model.hpp"
#include "solver/launch.hpp"

namespace cohort {

/// Cells of one model by themselves, each with its own parameters and pacing (kernels/single_cells.cl):
/// restitution curves, steady states, action potentials. All times are in ms and become whole numbers of
/// steps.
class SingleCells {
 public:
  /// A train of pulses from the start on; then, if `extra_ms` > 0, one more that long after the last.
  struct Pacing {
    double period_ms = 1000;
    int pulses = 1;
    double extra_ms = 0;
  };
  struct Stimulus {
    double duration_ms = 1, amplitude_mV_per_ms = 40;
  };
  /// What was recorded, cell by cell: V in mV, and the states asked for, (states, samples).
  struct Trace {
    double interval_ms = 0;
    std::vector<std::vector<double>> V;
    std::vector<std::vector<std::vector<double>>> states;
  };

  SingleCells(Launcher& launcher, Precision precision, const std::string& model, int cells);

  /// Throws std::out_of_range where the model has no such parameter.
  void set(int cell, const std::string& parameter, double value);
  const CellModel& model() const { return model_; }
  int cells() const { return cells_; }

  /// The largest of the cells' fastest rates, 1/ms.
  double fastest_rate();
  /// Initial states everywhere.
  void initialise();
  /// V (cells) mV and states (states, cells).
  std::vector<double> potential() { return read(V_, static_cast<std::size_t>(cells_)); }
  std::vector<double> states() {
    return read(states_, static_cast<std::size_t>(cells_) * model_.states.size());
  }
  void write(const std::vector<double>& V, const std::vector<double>& states);

  /// Goes on for length_ms from where the cells are; records every interval_ms. One Pacing for each cell.
  Trace pace(const std::vector<Pacing>& pacing, const Stimulus& stimulus, double length_ms, double dt_ms,
             double interval_ms, const std::vector<std::string>& record = {});

 private:
  std::vector<double> read(const cl::Buffer& buffer, std::size_t count);
  void derive(double dt_ms);

  Launcher& launcher_;
  Precision precision_;
  CellModel model_;
  int cells_, padded_, width_;
  std::vector<double> parameters_;  ///< (padded cells, parameters)
  cl::Buffer parameter_buffer_, derived_, fastest_rate_, V_, states_;
  Launcher::Handle derive_, initialise_, pace_;
};

}  // namespace cohort
