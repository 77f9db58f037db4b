#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "solver/launch.hpp"
#include "solver/solid_mesh.hpp"

namespace cohort {

class LumpedCirculation;
struct SolidLabels;

/// How a member's tissue ended; kernels/solid.clh.
enum class SolidEnd { moves, settled, inverted, runaway, unsettled, stiff, overstepped };

/// Deforming tissue of a batch of members on the device: geometry, fields, and the launches of a step
/// (kernels/solid*.cl). Whoever steps it owns the member's kernel between predict() and move().
class Solid {
 public:
  /// grid: of the mechanics; its definitions (NX, NY, NZ) must be those of `definitions`.
  /// viscous: whether some member's tissue is. more: -D options, of what drives its tension.
  Solid(Launcher& launcher, const Scene& scene, const Definitions& definitions, const Grid& grid, int members,
        bool viscous = false, const std::vector<std::string>& more = {});

  /// Geometry, fibres, supports of `members`, whose blocks stand in `parameters`; everything at rest.
  void build(const cl::Buffer& parameters, std::span<const Member> members);
  /// Why member m cannot run; empty when it can.
  const std::string& defect(std::size_t m) const { return mesh_.defects[m]; }
  /// Of the six rigid motions of member m, those that no clamp and no spring resists.
  int free_motions(std::size_t m) const { return free_motions_[m]; }

  /// Activation times of the cells in the order of mesh(), ms; negative without.
  void activate(const std::vector<float>& times);
  /// What drives the tension from now on: kernels/tension_drive.clh.
  /// Members that wait go on to time_ms since the first beat's begin (kernels/solid_windows.cl).
  void release(double time_ms);
  void drive(const cl::Buffer& values, const cl::Buffer& column, const Real4& clock);
  void drive(const cl::Buffer& values, const std::vector<double>& column, const Real4& clock);
  void forces(const cl::Buffer& parameters);
  /// sampled: of a beating heart kinetic energy and that of springs as well.
  void predict(bool sampled);
  /// Member's kernel for prescribed pressures.
  void load(bool measured);
  /// Member's kernel of a beating heart: inflation, then the circulation with the tissue's cavities.
  void beat(const cl::Buffer& parameters, const LumpedCirculation& circulation, int samples, bool sampled,
            bool measured);
  void move();
  /// Looks at cells and nodes, for the step and the energy: behind forces(), whose tensions it reads.
  void measure(const cl::Buffer& parameters);
  /// Which of two steps in turn: counts move().
  int odd() const { return odd_; }

  /// The cell of member k with the smallest ratio of volume now to that at rest, and the ratio; NaN if any
  /// is.
  std::pair<std::size_t, double> worst_cell(std::size_t k);
  /// What went wrong with member k, and where.
  std::string failure(std::size_t k, SolidEnd end);
  /// Centre of a cell at rest, mm.
  std::array<double, 3> centre(std::size_t cell) const;

  /// The largest step at rest, ms.
  double first_step_ms(const cl::Buffer& parameters);
  /// Series of cavities under prescribed pressures, as load() took them: (members, 2, cavities, samples)
  /// pressures in mmHg, volumes in mL; NaN where there is none.
  std::vector<float> cavity_series();

  /// Device bytes of what has been built, at most at once.
  std::size_t bytes() const;
  /// Of these, what is given back when all is built.
  std::size_t scratch_bytes() const;

  const SolidMesh& mesh() const { return mesh_; }
  const cl::Program& program() const { return program_; }
  const cl::Buffer& states() const { return state_; }
  const cl::Buffer& displacements() const { return u_; }
  const cl::Buffer& activations() const { return activation_; }
  /// By tiles (tension_fields): the law's states, then the stretch, then the tension.
  const cl::Buffer& tension_states() const { return tension_; }
  int stretch_field() const { return tension_states_; }
  int tension_fields() const { return tension_states_ + (balances_ ? 4 : 2); }
  const Grid& grid() const { return grid_; }
  /// State of the members (members, state_size), kernels/solid.clh.
  std::vector<double> state();
  void set_state(const std::vector<double>& state);
  /// Field (3, nodes).
  std::vector<double> displacement();
  /// Fibres, then wall normals where the law reads them: (points, 3, cells) each.
  std::vector<double> directions();
  std::vector<double> velocity();
  /// Tension of the cells as forces() found it, kPa.
  std::vector<double> tensions();
  void set_motion(const std::vector<double>& displacement, const std::vector<double>& velocity);
  /// Where a material point of a member lies: nodes and weights of its cell, or of the nearest one.
  struct Place {
    std::array<int, 8> nodes{};
    std::array<double, 8> weights{};
    double beyond_mm = 0;  ///< its distance from that cell along the axis where it is largest
  };
  Place place_of(std::size_t m, const std::array<double, 3>& X) const;
  /// Displacement of the material point X of member m.
  std::array<double, 3> displacement_at(std::size_t m, const std::array<double, 3>& X,
                                        const std::vector<double>& displacement) const;

  /// kernels/solid.clh has the same list.
  enum Slot {
    time,
    step,
    odd_step,
    largest_step,
    damping,
    load_share,
    beat_time,
    beat_number,
    beat_length,
    halt,
    halted,
    since_halt,
    kinetic,
    residual,
    smallest_J,
    largest_speed2,
    wave_rate2,
    wave_size,
    pressure_share,
    strain_energy,
    first_step,
    ended,
    steps_done,
    first_pressure,
    first_volume = first_pressure + 4,
    last_pressure = first_volume + 4,
    next_sample = last_pressure + 4,
    time_lost,
    step_damping,
    balanced_beat,
    looked_at,
    losing,
    first_stored,
    damped,
    swept,
    cavity_work = swept + 4,
    active_work = cavity_work + 4,
    stored_change,
    dissipated,
    balanced_work,
    balance_end = balanced_work + 3,
    step_share,
    window_end,
    waits,
    held_step,
    held_behind,
    state_size
  };

 private:
  static constexpr int member_group = 128;  ///< work-items of a member in the launch that joins its sums

  SolidParts find_parts(const cl::Buffer& parameters);
  /// All that a batch has.
  std::vector<cl::Buffer> buffers() const;
  void release();
  void upload(const cl::Buffer& parameters, std::span<const Member> members);
  void find_fastest_mode(const cl::Buffer& parameters);
  void build_supports(std::span<const Member> members);
  cl::Buffer reals(const std::vector<double>& host);
  cl::Buffer zeros(std::size_t count);
  /// Local memory of a work-group of solid_forces.
  std::size_t bytes_of_tile() const;
  /// The node of member k whose waves bounded the step when they were last measured.
  std::size_t fastest_node(std::size_t k);
  std::string overstepped(std::size_t k);
  /// `count` numbers of a field from `first` on.
  std::vector<double> read(const cl::Buffer& field, std::size_t count, std::size_t first = 0);
  /// Of a field by tiles: (count, cells).
  std::vector<double> by_component(const std::vector<double>& tiles, std::size_t count) const;

  Launcher& launcher_;
  const Scene& scene_;
  Grid grid_;
  int capacity_, members_ = 0, odd_ = 0, voids_, tension_states_ = 0;
  std::size_t samples_;  ///< of cavities under prescribed pressures
  bool wide_, viscous_, sheets_ = false, balances_;
  std::shared_ptr<const SolidLabels> labels_;  ///< geometry `labels`: what its cells hold
  SolidMesh mesh_;
  int supports_ = 0, moving_blocks_ = 0;
  std::vector<int> free_motions_;
  cl::Program program_;
  cl::Buffer parameters_, series_;
  Real4 loads_{};  ///< kernels/solid_load.cl
  cl::Buffer state_, member_of_cell_, member_of_node_, member_of_item_, cell_nodes_, share_, region_,
      direction_, activation_, tension_, u_, v_, force_, item_cell_, item_cavity_, item_share_, item_faces_,
      position_, lid_, gradient_, volume_, corners_, tile_slots_, slot_node_, cell_slots_, first_slot_,
      node_slots_, cavity_block_, cavity_ends_, moving_, pulls_, inverse_mass_, support_of_, support_,
      cavity_of_, cavity_first_, cavity_slots_, item_tile_slots_, item_slot_node_, item_slots_,
      cavity_gradient_, node_sums_, measures_, node_blocks_, cell_blocks_, item_blocks_, pressures_,
      inflation_, damping_, cell_bounds_, speeds_, dashpots_, drive_, drive_column_;
  Real4 drive_clock_{};
  Launcher::Handle parts_, vertex_voids_, fibres_, forces_, predict_, member_, move_, measure_, bound_,
      wave_start_, wave_cells_, wave_nodes_, wave_member_, find_dashpots_, release_;
};

}  // namespace cohort
