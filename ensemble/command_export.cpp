#include "ensemble/command_export.hpp"

#include <spdlog/spdlog.h>

#include <stdexcept>

#include "ensemble/choose_device.hpp"
#include "ensemble/config.hpp"
#include "ensemble/members.hpp"
#include "solver/export_labels.hpp"

namespace cohort {

namespace {

void export_labels(const std::string& file, Device& device, const Campaign& campaign, const Member& member,
                   double spacing_mm) {
  const LabelImage image = label_image(device, campaign.scene, member, spacing_mm);
  write_label_image(file, image);
  spdlog::info("{}: {} x {} x {} labels of {:.4g} mm, member {}", file, image.cells[0], image.cells[1],
               image.cells[2], image.spacing_mm()[0], member.id);
}

}  // namespace

ExitCode command_export(const CampaignOptions& options) {
  const Campaign campaign = read_campaign(options.file, options.overrides);
  for (const std::string& what : options.exports)
    if (!is_nifti_name(what))
      throw std::runtime_error("--export " + what +
                               ": cannot be told what to write; name a file .nii or .nii.gz");
  const std::vector<Member> all = members(campaign);
  if (options.export_member < 0 || options.export_member >= static_cast<std::int64_t>(all.size()))
    throw std::runtime_error(
        fmt::format("--member {}: the campaign has members 0 to {}", options.export_member, all.size() - 1));
  const Member& member = all[static_cast<std::size_t>(options.export_member)];
  share_cores({});
  Device device(choose_device(options.device, {}));
  for (const std::string& what : options.exports)
    export_labels(what, device, campaign, member, options.export_spacing_mm);
  return ExitCode::done;
}

}  // namespace cohort
