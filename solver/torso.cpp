#include "solver/torso.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace cohort {
namespace {

constexpr double tolerance = 1e-6;   // |b - A x| / |b| aimed at
constexpr double acceptable = 1e-4;  // single precision may stop short of the aim, never here
constexpr int window = 4 * 4 * 4;    // cells of an electrode
constexpr int electrodes = static_cast<int>(electrode_names.size());
/// Where ellipsoids overlap, the first owns the place.
constexpr const char* inclusion_names[] = {"heart", "left_lung", "right_lung"};

/// Sizes of a torso that is not unbounded.
struct Sizes {
  Point centre, half;  // mm
  double exponent;     // cylinder
};

Sizes sizes(TorsoKind kind, const ParameterTable& table, const std::vector<double>& values) {
  const auto value = [&](const char* name) {
    return values[static_cast<std::size_t>(table.index(std::string("torso.") + name))];
  };
  const double lower = value("lower_mm"), upper = value("upper_mm");
  return {{0, 0, (lower + upper) / 2},
          {value("half_width_mm"), value("half_depth_mm"), (upper - lower) / 2},
          kind == TorsoKind::cylinder ? value("exponent") : 2.0};
}

Point vector_value(const ParameterTable& table, const std::vector<double>& values, const std::string& path) {
  const auto first = static_cast<std::size_t>(table.index(path + ".x"));
  return {values[first], values[first + 1], values[first + 2]};
}

/// Level of a place in the torso: below 1 inside its cross-section, or for the ellipsoid inside; 1 on the
/// skin.
double level_of(TorsoKind kind, const Sizes& torso, const Point& place) {
  Point u;  // from the centre, in half-extents
  for (std::size_t i = 0; i < 3; ++i) u[i] = std::abs((place[i] - torso.centre[i]) / torso.half[i]);
  if (kind == TorsoKind::ellipsoid) return std::hypot(u[0], u[1], u[2]);
  if (kind == TorsoKind::box) return std::max(u[0], u[1]);
  return std::pow(std::pow(u[0], torso.exponent) + std::pow(u[1], torso.exponent), 1 / torso.exponent);
}

/// `place` on the skin, or as given when it is inside and may stay there.
Point on_skin(TorsoKind kind, const Sizes& torso, Point place, bool may_be_inside) {
  const double level = level_of(kind, torso, place);
  if (kind != TorsoKind::ellipsoid)
    place[2] = std::clamp(place[2], torso.centre[2] - torso.half[2], torso.centre[2] + torso.half[2]);
  if (level == 0 || (level <= 1 && may_be_inside)) return place;
  const std::size_t axes = kind == TorsoKind::ellipsoid ? 3 : 2;
  for (std::size_t i = 0; i < axes; ++i) place[i] = torso.centre[i] + (place[i] - torso.centre[i]) / level;
  return place;
}

}  // namespace

void declare_torso(ParameterTable& table, TorsoKind kind) {
  const std::string notes = "chosen to give a normal ECG; one of many possible sets";
  table.add({"torso.conductivity_mS_per_mm", "mS/mm", 0.20, 1e-3, 10, "conductivity of the torso, isotropic",
             notes});
  if (kind != TorsoKind::unbounded) {
    Parameter dx{"torso.dx_mm",
                 "mm",
                 5,
                 1,
                 20,
                 "edge of a cell of the torso's grid",
                 "measured: tests/verification/lead_field.cpp"};
    dx.structural = true;
    table.add(dx);
    table.add({"torso.half_width_mm", "mm", 175, 40, 400, "half of the width, left to right", notes});
    table.add({"torso.half_depth_mm", "mm", 125, 40, 400, "half of the depth, front to back", notes});
    table.add({"torso.lower_mm", "mm", -250, -800, -40, "height of the lower end", notes});
    table.add({"torso.upper_mm", "mm", 200, 40, 800, "height of the upper end", notes});
  }
  if (kind != TorsoKind::unbounded) {
    const Point centres[] = {{29, -33, -3}, {85, 0, 5}, {-85, 0, 5}},
                semi_axes[] = {{45, 45, 45}, {45, 70, 110}, {45, 70, 110}};
    for (std::size_t n = 0; n < std::size(inclusion_names); ++n) {
      const std::string path = std::string("torso.inclusions.") + inclusion_names[n] + ".";
      table.add({path + "conductivity_ratio", "1", 1, 1e-3, 1e3,
                 "conductivity of an ellipsoid over the torso's; 1 for none", "none: homogeneous"});
      table.add_vector({path + "centre_mm", "mm", 0, -800, 800, "its centre", notes}, centres[n][0],
                       centres[n][1], centres[n][2]);
      table.add_vector({path + "semi_axes_mm", "mm", 0, 1, 800, "its semi-axis", notes}, semi_axes[n][0],
                       semi_axes[n][1], semi_axes[n][2]);
    }
  }
  if (kind == TorsoKind::cylinder)
    table.add({"torso.exponent", "1", 2.5, 1.5, 20,
               "of the cross-section |x/a|^n + |y/b|^n < 1; 2: an ellipse", notes});

  table.add({"torso.heart.azimuth_deg", "deg", 58, -180, 180, "apex: angle from left to the front", notes});
  table.add({"torso.heart.elevation_deg", "deg", 33, -89, 89, "apex: angle below the horizontal", notes});
  table.add({"torso.heart.roll_deg", "deg", -8, -180, 180,
             "about the long axis: anterior wall from above to the front, right ventricle down", notes});
  table.add_vector({"torso.heart.point_mm", "mm", 0, -200, 200,
                    "point of the heart's frame, at scale 1, that is put at position_mm", notes},
                   10, 0, -36);
  // A longer heart reaches as much further to both sides.
  const char* length = "geometry.heart.lv_length_mm";
  if (table.find(length) >= 0) {
    Parameter& depth = table[table.index("torso.heart.point_mm.z")];
    depth.value = inherited;
    depth.inherits = length;
    depth.inherits_factor = -0.4;
  }
  table.add_vector(
      {"torso.heart.position_mm", "mm", 0, -400, 400, "where in the torso: left, posterior, superior", notes},
      29, -33, -3);

  // On the front and the left of the default cylinder, where only a height and a width or depth are known.
  const auto front = [](double x) { return -125 * std::pow(1 - std::pow(std::abs(x) / 175, 2.5), 0.4); };
  const auto left = [](double y) { return 175 * std::pow(1 - std::pow(std::abs(y) / 125, 2.5), 0.4); };
  const Point places[] = {{-140, -12, 175},     {140, -12, 175},        {88, front(88), -235},
                          {-22, front(22), 10}, {22, front(22), 10},    {53, front(53), -5},
                          {85, front(85), -20}, {122, front(122), -20}, {left(31), -31, -20}};
  for (std::size_t e = 0; e < electrode_names.size(); ++e)
    table.add_vector({"torso.electrodes." + std::string(electrode_names[e]) + "_mm", "mm", 0, -1000, 1000,
                      e < 2 ? "electrode, inside or on the skin: left, posterior, superior"
                            : "electrode, moved onto the skin: left, posterior, superior",
                      notes},
                     places[e][0], places[e][1], places[e][2]);
}

Point Pose::operator()(const Point& p) const {
  Point result = translation_mm;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) result[i] += rotation[3 * i + j] * p[j];
  return result;
}

Pose heart_pose(const ParameterTable& table, const std::vector<double>& values) {
  const auto radians = [&](const char* name) {
    return values[static_cast<std::size_t>(table.index(std::string("torso.heart.") + name))] *
           std::numbers::pi / 180;
  };
  const double az = radians("azimuth_deg"), el = radians("elevation_deg"), roll = radians("roll_deg");
  const double ca = std::cos(az), sa = std::sin(az), ce = std::cos(el), se = std::sin(el);
  const double cr = std::cos(roll), sr = std::sin(roll);
  const Point base = {-ce * ca, ce * sa, se};      // heart's z
  const Point septum = {-sa, -ca, 0};              // heart's x at roll 0: horizontal, to the right and front
  const Point anterior = {se * ca, -se * sa, ce};  // heart's y at roll 0: z cross x
  Pose pose{};
  for (std::size_t i = 0; i < 3; ++i) {
    pose.rotation[3 * i] = cr * septum[i] - sr * anterior[i];
    pose.rotation[3 * i + 1] = sr * septum[i] + cr * anterior[i];
    pose.rotation[3 * i + 2] = base[i];
  }
  Point point = vector_value(table, values, "torso.heart.point_mm");
  if (const int scale = table.find("geometry.heart.scale"); scale >= 0)
    for (double& x : point) x *= values[static_cast<std::size_t>(scale)];
  const Point turned = pose(point);
  const Point position = vector_value(table, values, "torso.heart.position_mm");
  for (std::size_t i = 0; i < 3; ++i) pose.translation_mm[i] = position[i] - turned[i];
  return pose;
}

std::array<Point, 9> electrode_places(TorsoKind kind, const ParameterTable& table,
                                      const std::vector<double>& values) {
  std::array<Point, 9> places;
  for (std::size_t e = 0; e < places.size(); ++e) {
    places[e] = vector_value(table, values, "torso.electrodes." + std::string(electrode_names[e]) + "_mm");
    if (kind != TorsoKind::unbounded) places[e] = on_skin(kind, sizes(kind, table, values), places[e], e < 2);
  }
  return places;
}

Torso::Torso(Device& device, const Scene& scene, int fields)
    : device_(device),
      kind_(scene.torso),
      double_(scene.precision == Precision::double_),
      count_(fields),
      table_(scene.parameters) {
  table_.index("torso.conductivity_mS_per_mm");
  for (int i = 0; i < table_.size(); ++i) {
    const std::string& path = table_[i].path;
    if (path.starts_with("torso.") && !path.starts_with("torso.heart.") &&
        path != "torso.conductivity_mS_per_mm")
      key_parameters_.push_back(i);
  }
  if (kind_ == TorsoKind::unbounded) return;
  std::vector<std::string> definitions = {kind_ == TorsoKind::box         ? "TORSO_BOX"
                                          : kind_ == TorsoKind::ellipsoid ? "TORSO_ELLIPSOID"
                                                                          : "TORSO_CYLINDER"};
  if (double_) definitions.push_back("DOUBLE");
  program_ = device_.build({"elliptic.clh", "torso.cl"}, definitions);
}

std::vector<std::string> Torso::definitions() const {
  std::vector<std::string> result = {"ELECTRODES=" + std::to_string(electrodes)};
  if (kind_ == TorsoKind::unbounded) result.push_back("LEAD_FIELD_UNBOUNDED");
  return result;
}

/// The grid is centred on the torso and just holds it.
Torso::Box Torso::box(const std::vector<double>& values) const {
  const Sizes torso = sizes(kind_, table_, values);
  Box grid{torso.centre, torso.half, {}, {}, values[static_cast<std::size_t>(table_.index("torso.dx_mm"))]};
  for (std::size_t i = 0; i < 3; ++i) {
    constexpr double rounding = 1e-9;
    grid.cells[i] = std::max(4, static_cast<int>(std::ceil(2 * grid.half[i] / grid.dx - rounding)));
    grid.corner[i] = grid.centre[i] - grid.cells[i] * grid.dx / 2;
  }
  return grid;
}

bool Torso::holds(std::span<const Point> places_mm, const std::vector<double>& values) const {
  if (kind_ == TorsoKind::unbounded) return true;
  const Sizes torso = sizes(kind_, table_, values);
  return std::all_of(places_mm.begin(), places_mm.end(), [&](const Point& place) {
    const bool between_ends =
        kind_ == TorsoKind::ellipsoid || std::abs(place[2] - torso.centre[2]) < torso.half[2];
    return between_ends && level_of(kind_, torso, place) < 1;
  });
}

std::size_t Torso::cells(const std::vector<double>& values) const {
  const std::array<int, 3> extent = box(values).cells;
  return static_cast<std::size_t>(extent[0]) * static_cast<std::size_t>(extent[1]) *
         static_cast<std::size_t>(extent[2]);
}

std::size_t Torso::bytes(const std::vector<double>& values) const {
  if (kind_ == TorsoKind::unbounded) return 64;
  const Box grid = box(values);
  const std::size_t real = double_ ? sizeof(double) : sizeof(float);
  std::size_t padded = 1, corners = 1;
  for (const int n : grid.cells) {
    padded *= static_cast<std::size_t>(n) + 2;
    corners *= static_cast<std::size_t>(n) + 1;
  }
  const auto count = static_cast<std::size_t>(count_);
  return EllipticSolver::bytes(device_, grid.cells, count_, double_) +
         real * (2 * count * padded + corners + electrodes * window) + 3 * electrodes * sizeof(cl_int);
}

const LeadFields& Torso::fields(const std::vector<double>& values) {
  std::vector<double> key;
  for (const int i : key_parameters_) key.push_back(values[static_cast<std::size_t>(i)]);
  if (key == key_) return fields_;
  key_.clear();  // stays so when the solve fails
  if (kind_ == TorsoKind::unbounded) {
    if (!fields_.potential()) fields_.potential = device_.allocate(64, "potential");
    fields_.electrodes_mm = electrode_places(kind_, table_, values);
  } else {
    solve(values);
  }
  key_ = key;
  return fields_;
}

void Torso::set_up(const std::vector<double>& values) {
  if (kind_ == TorsoKind::unbounded)
    throw std::invalid_argument("an unbounded torso has no grid to solve on");
  std::vector<double> key;
  for (const int i : key_parameters_) key.push_back(values[static_cast<std::size_t>(i)]);
  if (key == set_up_key_) return;
  set_up_key_.clear();
  const Box grid = box(values);
  const std::size_t real = double_ ? sizeof(double) : sizeof(float);
  if (!solver_ || solver_->cells() != grid.cells) {
    solver_.reset();
    solver_ = std::make_unique<EllipticSolver>(device_, grid.cells, count_, double_, Couplings::faces,
                                               std::source_location::current());
    const std::size_t field = solver_->field_cells();
    if (count_ == electrodes) {
      source_ = device_.allocate(electrodes * field * real, "source");
      fields_.potential = device_.allocate(electrodes * field * real, "potential");
    }
    std::size_t corners = 1;
    for (const int n : grid.cells) corners *= static_cast<std::size_t>(n) + 1;
    level_ = device_.allocate(corners * real, "level");
    weights_ = device_.allocate(electrodes * window * real, "weights");
    windows_ = device_.allocate(3 * electrodes * sizeof(cl_int), "windows");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    fields_.extent[i] = grid.cells[i] + 2;
    fields_.origin_mm[i] = grid.corner[i] - grid.dx / 2;
  }
  fields_.dx_mm = grid.dx;
  fields_.electrodes_mm = electrode_places(kind_, table_, values);
  if (double_)
    enqueue_conductances<double>(values, grid);
  else
    enqueue_conductances<float>(values, grid);
  set_up_key_ = key;
}

void Torso::solve(const std::vector<double>& values) {
  set_up_key_.clear();  // the set-up writes the sources too
  set_up(values);
  const Box grid = box(values);
  const EllipticResult result = solver_->solve(source_, fields_.potential, tolerance);
  ++solves_;
  fields_.iterations = result.iterations;
  fields_.relative_residual = result.relative_residual;
  if (!(result.relative_residual < acceptable))
    throw std::runtime_error("the lead fields do not converge: relative residual " +
                             std::to_string(result.relative_residual) + " after " +
                             std::to_string(result.iterations) + " iterations");

  Device::Counted counted = device_.kernel(program_, "continue_outside");
  cl::Kernel& outside = counted.kernel;
  for (cl_uint i = 0; i < 3; ++i) outside.setArg(i, grid.cells[i]);
  outside.setArg(3, solver_->inverse_diagonal());
  outside.setArg(4, fields_.potential);
  device_.queue().enqueueNDRangeKernel(
      outside, cl::NullRange,
      cl::NDRange(static_cast<std::size_t>(fields_.extent[0]), static_cast<std::size_t>(fields_.extent[1]),
                  static_cast<std::size_t>(fields_.extent[2] * electrodes)));
  device_.count_launch(counted.place);
}

/// Ellipsoids of another conductivity, from the first on: centre and semi-axes in cells of the buffer, and
/// the ratio of their conductivity to the torso's; none whose ratio is one.
std::vector<double> Torso::inclusions(const std::vector<double>& values, const Box& grid) const {
  std::vector<double> result;
  for (const char* name : inclusion_names) {
    const std::string path = std::string("torso.inclusions.") + name + ".";
    const double ratio = values[static_cast<std::size_t>(table_.index(path + "conductivity_ratio"))];
    if (ratio == 1) continue;
    const Point centre = vector_value(table_, values, path + "centre_mm"),
                semi_axes = vector_value(table_, values, path + "semi_axes_mm");
    for (std::size_t i = 0; i < 3; ++i) result.push_back((centre[i] - fields_.origin_mm[i]) / grid.dx);
    for (std::size_t i = 0; i < 3; ++i) result.push_back(semi_axes[i] / grid.dx);
    result.push_back(ratio);
  }
  return result;
}

/// Conductances, coarse levels, the electrodes' weights and, for nine fields, their right-hand sides.
template <typename Real>
void Torso::enqueue_conductances(const std::vector<double>& values, const Box& grid) {
  cl::CommandQueue& queue = device_.queue();
  const auto range = [&](int more) {
    return cl::NDRange(static_cast<std::size_t>(grid.cells[0] + more),
                       static_cast<std::size_t>(grid.cells[1] + more),
                       static_cast<std::size_t>(grid.cells[2] + more));
  };
  const auto counted = [&](const char* name) {  // each is launched once
    const Device::Counted kernel = device_.kernel(program_, name);
    device_.count_launch(kernel.place);
    return kernel.kernel;
  };
  cl::Kernel level = counted("torso_level_set"), conductance = counted("torso_conductance"),
             currents = counted("electrode_currents");
  for (cl_uint i = 0; i < 3; ++i) {
    level.setArg(i, grid.cells[i]);
    level.setArg(3 + i, static_cast<Real>((grid.corner[i] - grid.centre[i]) / grid.half[i]));
    level.setArg(6 + i, static_cast<Real>(grid.dx / grid.half[i]));
    conductance.setArg(i, grid.cells[i]);
    currents.setArg(i, grid.cells[i]);
  }
  level.setArg(9, static_cast<Real>(sizes(kind_, table_, values).exponent));
  level.setArg(10, level_);
  queue.enqueueNDRangeKernel(level, cl::NullRange, range(1));

  conductance.setArg(3, static_cast<Real>(grid.dx));
  conductance.setArg(4, level_);
  conductance.setArg(5, solver_->conductance());
  queue.enqueueNDRangeKernel(conductance, cl::NullRange, range(0));

  std::vector<Real> places;  // in cells of the buffer
  for (const Point& place : fields_.electrodes_mm)
    for (std::size_t i = 0; i < 3; ++i)
      places.push_back(static_cast<Real>((place[i] - fields_.origin_mm[i]) / grid.dx));
  cl::Buffer place(device_.context(), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, places.size() * sizeof(Real),
                   places.data());
  const bool inject = count_ == electrodes;
  if (inject)
    queue.enqueueFillBuffer(source_, cl_uchar{0}, 0, electrodes * solver_->field_cells() * sizeof(Real));
  currents.setArg(3, static_cast<Real>(grid.dx));
  currents.setArg(4, solver_->conductance());
  currents.setArg(5, place);
  currents.setArg(6, inject ? source_ : weights_);
  currents.setArg(7, weights_);
  currents.setArg(8, windows_);
  currents.setArg(9, cl_int{inject});
  queue.enqueueNDRangeKernel(currents, cl::NullRange, cl::NDRange(electrodes));

  const std::vector<double> ellipsoids = inclusions(values, grid);
  if (!ellipsoids.empty()) {
    std::vector<Real> numbers(ellipsoids.begin(), ellipsoids.end());
    const cl::Buffer buffer(device_.context(), CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR,
                            numbers.size() * sizeof(Real), numbers.data());
    cl::Kernel include = counted("torso_inclusions");
    for (cl_uint i = 0; i < 3; ++i) include.setArg(i, grid.cells[i]);
    include.setArg(3, static_cast<cl_int>(numbers.size() / 7));
    include.setArg(4, buffer);
    include.setArg(5, solver_->conductance());
    queue.enqueueNDRangeKernel(include, cl::NullRange, range(0));
    queue.finish();  // the buffer is ours
  }
  solver_->prepare();
}

std::vector<double> Torso::block(const std::vector<double>& values) {
  const LeadFields& lead = fields(values);
  const Pose pose = heart_pose(table_, values);
  std::vector<double> result(pose.rotation.begin(), pose.rotation.end());
  result.insert(result.end(), pose.translation_mm.begin(), pose.translation_mm.end());
  result.push_back(1 / values[static_cast<std::size_t>(table_.index("torso.conductivity_mS_per_mm"))]);
  result.push_back(lead.dx_mm > 0 ? 1 / lead.dx_mm : 0);
  result.insert(result.end(), lead.origin_mm.begin(), lead.origin_mm.end());
  for (const int n : lead.extent) result.push_back(n);
  for (const Point& place : lead.electrodes_mm) result.insert(result.end(), place.begin(), place.end());
  return result;
}

}  // namespace cohort
