// Scenes of signed distance shapes: parameters, generated kernel source, extent.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "solver/geometry_kinds.hpp"

namespace cohort {

namespace {

using Kind = Shape::Kind;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Name of a kind in the YAML file and in parameter paths.
std::string kind_name(Kind kind) {
  switch (kind) {
    case Kind::box:
      return "box";
    case Kind::ellipsoid:
      return "ellipsoid";
    case Kind::cylinder:
      return "cylinder";
    case Kind::cone:
      return "cone";
    case Kind::capsule:
      return "capsule";
    case Kind::half_space:
      return "half_space";
    case Kind::union_:
      return "union";
    case Kind::intersection:
      return "intersection";
    case Kind::subtract:
      return "subtract";
    case Kind::smooth_union:
      return "smooth_union";
    case Kind::shell:
      return "shell";
  }
  throw std::logic_error("unknown shape");
}

bool is_primitive(Kind kind) {
  return kind <= Kind::half_space;
}

std::string prefix(const Shape& shape) {
  return "geometry.shapes." + shape.name + "." + kind_name(shape.kind) + ".";
}

const Shape& find(const Scene& scene, const std::string& name) {
  const auto it =
      std::find_if(scene.shapes.begin(), scene.shapes.end(), [&](const Shape& s) { return s.name == name; });
  if (it == scene.shapes.end()) throw std::invalid_argument("no shape \"" + name + "\"");
  return *it;
}

void check(const Scene& scene) {
  for (auto shape = scene.shapes.begin(); shape != scene.shapes.end(); ++shape) {
    const std::string what = "shape \"" + shape->name + "\"";
    const bool word =
        !shape->name.empty() && std::all_of(shape->name.begin(), shape->name.end(),
                                            [](unsigned char c) { return std::isalnum(c) || c == '_'; });
    if (!word) throw std::invalid_argument(what + ": a name holds letters, digits and _ only");
    const auto before = [&](const std::string& name) {
      return std::any_of(scene.shapes.begin(), shape, [&](const Shape& s) { return s.name == name; });
    };
    if (before(shape->name)) throw std::invalid_argument(what + " is named twice");
    const size_t n = shape->operands.size();
    if (is_primitive(shape->kind) && n != 0)
      throw std::invalid_argument(what + ": a " + kind_name(shape->kind) + " has no operands");
    if (shape->kind == Kind::shell && n != 1) throw std::invalid_argument(what + ": a shell has one operand");
    if (!is_primitive(shape->kind) && shape->kind != Kind::shell && n < 2)
      throw std::invalid_argument(what + ": " + kind_name(shape->kind) + " needs two operands or more");
    for (const std::string& operand : shape->operands)
      if (!before(operand))
        throw std::invalid_argument(what + " uses shape \"" + operand + "\", which is not defined before it");
  }
  if (scene.regions.empty()) throw std::invalid_argument("no region is filled by a shape");
  for (const Region& region : scene.regions)
    if (std::none_of(scene.shapes.begin(), scene.shapes.end(),
                     [&](const Shape& s) { return s.name == region.shape; }))
      throw std::invalid_argument("region \"" + region.name + "\" is filled by shape \"" + region.shape +
                                  "\", which does not exist");
}

/// The wall whose surfaces set the transmural coordinate: a shell or a subtract, the shape itself or first
/// operands.
const Shape& wall(const Scene& scene, const Region& region) {
  const Shape* shape = &find(scene, region.shape);
  while (shape->kind != Kind::shell && shape->kind != Kind::subtract) {
    if (is_primitive(shape->kind))
      throw std::invalid_argument(
          "geometry.regions." + region.name + " has transmural fibres, but shape \"" + region.shape +
          "\" is no wall: a shell, or a subtract of the inner from the outer surface");
    shape = &find(scene, shape->operands.front());
  }
  return *shape;
}

std::string place(const Scene& scene, const std::string& path) {
  return std::to_string(scene.parameters.index(path));
}

/// Kernel expression of a parameter of `shape`.
std::string scalar(const Scene& scene, const Shape& shape, const std::string& size) {
  return "P[" + place(scene, prefix(shape) + size) + "]";
}

std::string vector(const Scene& scene, const Shape& shape, const std::string& size) {
  return "vector_parameter(P, " + place(scene, prefix(shape) + size + ".x") + ")";
}

std::string axis(const Scene& scene, const Shape& shape, const std::string& size) {
  return "unit_or_zero(" + vector(scene, shape, size) + ")";
}

std::string distance_of(const std::string& shape) {
  return "sd_shape_" + shape + "(p, P)";
}
std::string fraction_of(const std::string& shape) {
  return "fraction_shape_" + shape + "(p, h, P)";
}

/// f(f(a, b), c) ... of the operands' expressions.
std::string fold(const Shape& shape, const std::string& function,
                 const std::function<std::string(const std::string&)>& of, const std::string& last = {}) {
  std::string expression = of(shape.operands.front());
  for (size_t i = 1; i < shape.operands.size(); ++i)
    expression = function + "(" + expression + ", " + of(shape.operands[i]) + last + ")";
  return expression;
}

std::string distance_source(const Scene& scene, const Shape& shape) {
  const auto s = [&](const char* size) { return scalar(scene, shape, size); };
  const auto v = [&](const char* size) { return vector(scene, shape, size); };
  const std::string about_centre =
      is_primitive(shape.kind) && shape.kind != Kind::capsule && shape.kind != Kind::half_space
          ? "p - " + v("centre_mm")
          : "";
  switch (shape.kind) {
    case Kind::box:
      return "sd_box(" + about_centre + ", R(0.5) * " + v("size_mm") + ")";
    case Kind::ellipsoid:
      return "sd_ellipsoid(" + about_centre + ", " + v("semi_axes_mm") + ")";
    case Kind::cylinder:
      return "sd_cylinder(" + about_centre + ", " + axis(scene, shape, "axis") + ", " + s("radius_mm") +
             ", " + s("height_mm") + ")";
    case Kind::cone:
      return "sd_cone(" + about_centre + ", " + axis(scene, shape, "axis") + ", " + s("lower_radius_mm") +
             ", " + s("upper_radius_mm") + ", " + s("height_mm") + ")";
    case Kind::capsule:
      return "sd_capsule(p, " + v("from_mm") + ", " + v("to_mm") + ", " + s("radius_mm") + ")";
    case Kind::half_space:
      return "sd_half_space(p, " + v("point_mm") + ", " + axis(scene, shape, "normal") + ")";
    case Kind::union_:
      return fold(shape, "sd_union", distance_of);
    case Kind::intersection:
      return fold(shape, "sd_intersection", distance_of);
    case Kind::subtract:
      return fold(shape, "sd_subtract", distance_of);
    case Kind::smooth_union:
      return fold(shape, "sd_smooth_union", distance_of, ", " + s("smoothing_mm"));
    case Kind::shell:
      return "sd_shell(" + distance_of(shape.operands[0]) + ", " + s("thickness_mm") + ")";
  }
  throw std::logic_error("unknown shape");
}

/// Fractions follow the set algebra, so that walls thinner than a cell keep their mass.
std::string fraction_source(const Scene& scene, const Shape& shape) {
  switch (shape.kind) {
    case Kind::box:
      return "box_fraction(p - " + vector(scene, shape, "centre_mm") + ", R(0.5) * " +
             vector(scene, shape, "size_mm") + ", h)";
    case Kind::union_:
      return fold(shape, "fraction_union", fraction_of);
    case Kind::intersection:
      return fold(shape, "fraction_intersection", fraction_of);
    case Kind::subtract:
      return fold(shape, "fraction_subtract", fraction_of);
    case Kind::shell:
      return "shell_fraction(" + distance_of(shape.operands[0]) + ", " +
             scalar(scene, shape, "thickness_mm") + ", h)";
    default:
      return "cell_fraction(" + distance_of(shape.name) + ", h)";
  }
}

/// Reads the sizes of one shape of one member.
struct Sizes {
  const Scene& scene;
  const Shape& shape;
  std::span<const double> values;

  double operator()(const std::string& size) const {
    return values[size_t(scene.parameters.index(prefix(shape) + size))];
  }
  std::array<double, 3> vector(const std::string& size) const {
    return {(*this)(size + ".x"), (*this)(size + ".y"), (*this)(size + ".z")};
  }
};

Extent grown(Extent box, double by) {
  for (size_t i = 0; i < 3; ++i) {
    box.lower[i] -= by;
    box.upper[i] += by;
  }
  return box;
}

Extent common(Extent a, const Extent& b) {
  for (size_t i = 0; i < 3; ++i) {
    a.lower[i] = std::max(a.lower[i], b.lower[i]);
    a.upper[i] = std::min(a.upper[i], b.upper[i]);
  }
  return a;
}

/// Box of a truncated cone about `centre`.
Extent cone_box(const std::array<double, 3>& centre, const std::array<double, 3>& axis, double lower,
                double upper, double height) {
  const double length = std::max(std::hypot(axis[0], axis[1], axis[2]), 1e-12);
  Extent box{centre, centre};
  for (size_t i = 0; i < 3; ++i) {
    const double a = axis[i] / length, across = std::sqrt(std::max(0.0, 1 - a * a)), half = 0.5 * height * a;
    box.lower[i] += std::min(-half - lower * across, half - upper * across);
    box.upper[i] += std::max(-half + lower * across, half + upper * across);
  }
  return box;
}

Extent extent(const Scene& scene, const Shape& shape, std::span<const double> values) {
  const Sizes size{scene, shape, values};
  const auto operand = [&](size_t i) { return extent(scene, find(scene, shape.operands[i]), values); };
  const auto about = [](const std::array<double, 3>& centre, const std::array<double, 3>& half) {
    Extent box{centre, centre};
    for (size_t i = 0; i < 3; ++i) {
      box.lower[i] -= half[i];
      box.upper[i] += half[i];
    }
    return box;
  };
  switch (shape.kind) {
    case Kind::box: {
      const auto edges = size.vector("size_mm");
      return about(size.vector("centre_mm"), {0.5 * edges[0], 0.5 * edges[1], 0.5 * edges[2]});
    }
    case Kind::ellipsoid:
      return about(size.vector("centre_mm"), size.vector("semi_axes_mm"));
    case Kind::cylinder:
      return cone_box(size.vector("centre_mm"), size.vector("axis"), size("radius_mm"), size("radius_mm"),
                      size("height_mm"));
    case Kind::cone:
      return cone_box(size.vector("centre_mm"), size.vector("axis"), size("lower_radius_mm"),
                      size("upper_radius_mm"), size("height_mm"));
    case Kind::capsule: {
      const auto from = size.vector("from_mm"), to = size.vector("to_mm");
      return grown(hull({from, from}, {to, to}), size("radius_mm"));
    }
    case Kind::half_space: {  // bounded only where its normal lies along an axis
      Extent box{{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
      const auto normal = size.vector("normal"), point = size.vector("point_mm");
      for (size_t i = 0; i < 3; ++i)
        if (normal[(i + 1) % 3] == 0 && normal[(i + 2) % 3] == 0)
          (normal[i] > 0 ? box.upper : box.lower)[i] = point[i];
      return box;
    }
    case Kind::shell:
      return grown(operand(0), 0.5 * size("thickness_mm"));
    case Kind::subtract:
      return operand(0);
    case Kind::intersection:
    case Kind::union_:
    case Kind::smooth_union: {
      Extent box = operand(0);
      for (size_t i = 1; i < shape.operands.size(); ++i)
        box = shape.kind == Kind::intersection ? common(box, operand(i)) : hull(box, operand(i));
      return shape.kind == Kind::smooth_union
                 ? grown(box, 0.25 * size("smoothing_mm") * double(shape.operands.size() - 1))
                 : box;
    }
  }
  throw std::logic_error("unknown shape");
}

}  // namespace

void declare_shapes(Scene& scene) {
  check(scene);
  for (const Shape& shape : scene.shapes) {
    const std::string of = " of shape " + shape.name;
    const auto length = [&](const char* size, double value, double lower, const char* meaning) {
      scene.parameters.add({prefix(shape) + size, "mm", value, lower, 1000, meaning + of, "scene"});
    };
    const auto lengths = [&](const char* size, double x, double y, double z, double lower,
                             const char* meaning) {
      scene.parameters.add_vector({prefix(shape) + size, "mm", 0, lower, 1000, meaning + of, "scene"}, x, y,
                                  z);
    };
    const auto direction = [&](const char* size, const char* meaning) {
      scene.parameters.add_vector(
          {prefix(shape) + size, "1", 0, -1, 1, meaning + of + ", of any length", "scene"}, 0, 0, 1);
    };
    constexpr double smallest = 1e-3, anywhere = -1000;
    switch (shape.kind) {
      case Kind::box:
        lengths("centre_mm", 0, 0, 0, anywhere, "centre");
        lengths("size_mm", 10, 10, 10, smallest, "edge");
        break;
      case Kind::ellipsoid:
        lengths("centre_mm", 0, 0, 0, anywhere, "centre");
        lengths("semi_axes_mm", 10, 10, 10, smallest, "semi-axis");
        break;
      case Kind::cylinder:
        lengths("centre_mm", 0, 0, 0, anywhere, "centre");
        direction("axis", "axis");
        length("radius_mm", 5, smallest, "radius");
        length("height_mm", 10, smallest, "height");
        break;
      case Kind::cone:
        lengths("centre_mm", 0, 0, 0, anywhere, "centre");
        direction("axis", "axis, from the lower to the upper end,");
        length("lower_radius_mm", 5, 0, "radius of the lower end");
        length("upper_radius_mm", 2, 0, "radius of the upper end");
        length("height_mm", 10, smallest, "height");
        break;
      case Kind::capsule:
        lengths("from_mm", 0, 0, 0, anywhere, "one end");
        lengths("to_mm", 0, 0, 10, anywhere, "other end");
        length("radius_mm", 5, smallest, "radius");
        break;
      case Kind::half_space:
        lengths("point_mm", 0, 0, 0, anywhere, "point on the surface");
        direction("normal", "outward normal");
        break;
      case Kind::smooth_union:
        length("smoothing_mm", 2, 0, "length of the blend");
        break;
      case Kind::shell:
        length("thickness_mm", 1, smallest, "thickness");
        break;
      case Kind::union_:
      case Kind::intersection:
      case Kind::subtract:
        break;
    }
  }
  for (const Region& region : scene.regions)
    if (region.fibres == Region::Fibres::transmural) wall(scene, region);
}

std::string shapes_source(const Scene& scene) {
  // Macros, for this source stands before the types that the functions use.
  std::string functions = "#define SHAPE_FUNCTIONS", regions = "#define SHAPE_REGIONS(visit)",
              depths = "#define WALL_DEPTHS";
  std::string constant = "#define CONSTANT_FIBRES(region) (0";
  for (const Shape& shape : scene.shapes) {
    functions += " \\\n  real sd_shape_" + shape.name + "(real3 p, global const real *P) { return " +
                 distance_source(scene, shape) + "; }";
    functions += " \\\n  real fraction_shape_" + shape.name +
                 "(real3 p, real h, global const real *P) { return " + fraction_source(scene, shape) + "; }";
  }
  for (size_t i = 0; i < scene.regions.size(); ++i) {
    const Region& region = scene.regions[i];
    const std::string index = std::to_string(i);
    regions += " \\\n  visit(" + index + ", " + region.shape + ")";
    if (region.fibres == Region::Fibres::constant) constant += " || (region) == " + index;
    if (region.fibres != Region::Fibres::transmural) continue;
    const Shape& between = wall(scene, region);
    const std::string first = distance_of(between.operands[0]);
    if (between.kind == Kind::shell) {
      const std::string half = "R(0.5) * " + scalar(scene, between, "thickness_mm");
      depths += " \\\n  case " + index + ": return (real2)(" + half + " + " + first + ", " + half + " - " +
                first + ");";
    } else {
      depths += " \\\n  case " + index + ": return (real2)(" + distance_of(between.operands[1]) + ", -" +
                first + ");";
    }
  }
  return functions + "\n" + regions + "\n" + depths + "\n" + constant + ")\n";
}

Extent shapes_extent(const Scene& scene, std::span<const double> values) {
  Extent box = extent(scene, find(scene, scene.regions.at(0).shape), values);
  for (const Region& region : scene.regions) {
    const Extent part = extent(scene, find(scene, region.shape), values);
    for (size_t i = 0; i < 3; ++i)
      if (!std::isfinite(part.lower[i]) || !std::isfinite(part.upper[i]))
        throw std::invalid_argument("geometry.regions." + region.name +
                                    " has no bounds: nothing cuts its half-space");
    box = hull(box, part);
  }
  return box;
}

}  // namespace cohort
