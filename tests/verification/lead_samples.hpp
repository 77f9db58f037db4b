#pragma once

#include <string>
#include <vector>

#include "solver/torso.hpp"

namespace cohort {

/// Device array of `values` in the scene's precision.
inline cl::Buffer upload(Device& device, const std::vector<double>& values, bool double_precision) {
  const auto copy = [&](auto typed) {
    return cl::Buffer(device.context(), CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR,
                      typed.size() * sizeof typed[0], typed.data());
  };
  return double_precision ? copy(values) : copy(std::vector<float>(values.begin(), values.end()));
}

inline std::vector<double> download(Device& device, const cl::Buffer& buffer, std::size_t count,
                                    bool double_precision) {
  const auto read = [&](auto typed) {
    device.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, count * sizeof typed[0], typed.data());
    return std::vector<double>(typed.begin(), typed.end());
  };
  return double_precision ? read(std::vector<double>(count)) : read(std::vector<float>(count));
}

/// Z of the nine electrodes at each point, through kernels/lead_field.clh: shape (points, 9), mV/uA. The
/// points are in the frame of the torso, or of the heart when `of_heart`.
inline std::vector<double> sample(Device& device, const Scene& scene, Torso& torso,
                                  const std::vector<double>& values, const std::vector<Point>& points,
                                  bool of_heart = false) {
  const bool double_precision = scene.precision == Precision::double_;
  const std::string type = double_precision ? "double" : "float",
                    function = of_heart ? "lead_potential" : "lead_potential_at";
  const std::string source =
      type + " " + function + "(int, " + type + "3, global const " + type + " *, global const " + type +
      " *);\nkernel void sample(global const " + type + " *field, global const " + type +
      " *block, global const " + type + " *points, global " + type +
      " *z) {\n  const int i = get_global_id(0);\n  for (int e = 0; e < 9; ++e)\n    z[9 * i + e] = " +
      function + "(e, (" + type +
      "3)(points[3 * i], points[3 * i + 1], points[3 * i + 2]), field, block);\n}\n";
  std::vector<std::string> definitions = torso.definitions();
  if (double_precision) definitions.push_back("DOUBLE");
  cl::Kernel kernel(device.build({"lead_field.clh"}, definitions, source), "sample");
  std::vector<double> flat;
  for (const Point& p : points) flat.insert(flat.end(), p.begin(), p.end());
  const cl::Buffer block = upload(device, torso.block(values), double_precision);
  const cl::Buffer places = upload(device, flat, double_precision);
  const cl::Buffer result = upload(device, std::vector<double>(9 * points.size()), double_precision);
  kernel.setArg(0, torso.fields(values).potential);
  kernel.setArg(1, block);
  kernel.setArg(2, places);
  kernel.setArg(3, result);
  device.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(points.size()));
  return download(device, result, 9 * points.size(), double_precision);
}

}  // namespace cohort
