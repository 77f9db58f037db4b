#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "ensemble/choose_device.hpp"
#include "ensemble/commands.hpp"
#include "ensemble/config.hpp"
#include "ensemble/exports.hpp"
#include "ensemble/members.hpp"
#include "solver/export_labels.hpp"

namespace cohort {

namespace {

/// vtk names its folder after the store: heart_vtk for heart.h5; NAME_vtk is the folder.
bool is_vtk(const std::string& kind) {
  return kind == "vtk" || kind.ends_with("_vtk");
}

void check_kinds(const std::vector<std::string>& kinds) {
  for (const std::string& kind : kinds)
    if (!is_vtk(kind) && !is_nifti_name(kind))
      throw std::runtime_error(fmt::format(
          "--export {}: unknown; vtk, or a folder's name that ends in _vtk, writes the fields of a "
          "member, a file's name that ends in .nii or .nii.gz its heart as labels",
          kind));
}

void export_labels(const std::string& file, Device& device, const Campaign& campaign, const Member& member,
                   double spacing_mm) {
  const LabelImage image = label_image(device, campaign.scene, member, spacing_mm);
  write_label_image(file, image);
  spdlog::info("{}: {} x {} x {} labels of {:.4g} mm, member {}", file, image.cells[0], image.cells[1],
               image.cells[2], image.spacing_mm()[0], member.id);
}

}  // namespace

ExitCode command_export(const CampaignOptions& options) {
  check_kinds(options.exports);
  Campaign campaign = read_campaign(options.file, options.overrides);
  if (campaign.scene.geometry == GeometryKind::none)
    throw std::runtime_error("--export: there is no tissue to show; the geometry is none");
  if (!options.store.empty()) campaign.store = options.store;
  if (options.export_member < 0 || options.export_member >= campaign.members)
    throw std::runtime_error(
        fmt::format("--member {}: there are members 0 to {}", options.export_member, campaign.members - 1));
  // Activation is looked at whether or not the campaign records it.
  if (!campaign.scene.activation) campaign.scene.activation.emplace();
  const Member member = members(campaign)[static_cast<std::size_t>(options.export_member)];

  share_cores({});
  Device device(choose_device(options.device, {}));
  for (const std::string& kind : options.exports)
    if (is_nifti_name(kind))
      told_in_place(campaign,
                    [&] { export_labels(kind, device, campaign, member, options.export_spacing_mm); });
  const auto vtk = std::find_if(options.exports.begin(), options.exports.end(), is_vtk);
  if (vtk == options.exports.end()) return ExitCode::done;
  const std::filesystem::path folder =
      *vtk == "vtk" ? std::filesystem::path(campaign.store).replace_extension().string() + "_vtk" : *vtk;
  PlanOptions plan_options;
  plan_options.members_per_device = 1;
  Plan plan;
  told_in_place(campaign, [&] { plan = make_plan(device, campaign.scene, {&member, 1}, plan_options); });
  export_vtk({campaign, member, device, plan}, folder, options.export_every_ms);
  return ExitCode::done;
}

}  // namespace cohort
