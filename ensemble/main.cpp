#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "ensemble/commands.hpp"
#include "ensemble/guarded.hpp"
#include "ensemble/status.hpp"

namespace {

using namespace cohort;

/// Tables go to the standard output, everything else to the standard error.
void set_up_log(bool verbose) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("cohort"));
  spdlog::set_pattern("%H:%M:%S %^%l%$ %v");
  spdlog::set_level(verbose ? spdlog::level::debug : spdlog::level::info);
}

/// Not nan, which lies within every range that CLI11 compares with.
const CLI::Validator is_number(
    [](const std::string& text) {
      const bool number = std::isfinite(std::strtod(text.c_str(), nullptr));
      return number ? std::string() : text + " is no number that can be used";
    },
    "");

void add_campaign_options(CLI::App& command, CampaignOptions& options, bool file_required) {
  CLI::Option* file = command.add_option("FILE", options.file, "campaign file");
  if (file_required) file->required();
  command
      .add_option("--set", options.overrides,
                  "key=value: overrides a value of the file, by its path; repeatable")
      ->expected(1)
      ->take_all();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Cohort runs ensembles of simulated hearts.");
  app.set_version_flag("--version", "cohort " COHORT_VERSION);
  app.require_subcommand(1);
  bool verbose = false, watch = false;
  app.add_flag("-v,--verbose", verbose, "log what each step does");
  app.fallthrough();

  CampaignOptions options;
  std::string store;
  std::function<ExitCode()> chosen;

  CLI::App* run = app.add_subcommand("run", "run a campaign, or what is unfinished of it");
  add_campaign_options(*run, options, true);
  run->add_option("--store", options.store, "HDF5 file, instead of the campaign file's");
  run->add_option("--device", options.device, "cpu, gpu, or an index of `cohort devices`");
  CLI::Option* exported =
      run->add_option(
             "--export", options.exports,
             "instead of running the campaign, write one member: vtk or FOLDER_vtk, its fields for ParaView; "
             "FILE.nii or FILE.nii.gz, its heart as a map of labels; repeatable")
          ->expected(1)
          ->take_all();
  run->add_option("--member", options.export_member, "the member that --export writes; 0 unless given")
      ->needs(exported);
  run->add_option("--export-every", options.export_every_ms,
                  "ms between the potentials of --export vtk; 0: activation only")
      ->needs(exported)
      ->check(CLI::NonNegativeNumber & is_number);
  run->add_option(
         "--export-spacing", options.export_spacing_mm,
         "mm, edge of an exported label; unless given about 0.5, with 2 to 4 labels to a cell's edge")
      ->needs(exported)
      ->check(CLI::Range(0.01, 20.0) & is_number);
  run->callback([&] {
    chosen = [&] { return options.exports.empty() ? command_run(options) : command_export(options); };
  });

  CLI::App* plan = app.add_subcommand("plan", "what would run and what is left out, memory, steps, seconds");
  add_campaign_options(*plan, options, true);
  plan->add_option("--device", options.device, "cpu, gpu, or an index of `cohort devices`");
  plan->add_flag("--quick", options.quick, "runs no first steps: says nothing of kernels and seconds");
  plan->callback([&] { chosen = [&] { return command_plan(options); }; });

  CLI::App* study = app.add_subcommand(
      "study", "error against run time of a scene's settings, or its stability at the extremes");
  add_campaign_options(*study, options, true);
  study->get_option("FILE")->description("study file, as of configs/studies");
  study->add_option("--store", options.store, "HDF5 file, instead of the study file's");
  study->add_option("--device", options.device, "cpu, gpu, or an index of `cohort devices`");
  study->callback([&] { chosen = [&] { return command_study(options); }; });

  CLI::App* status =
      app.add_subcommand("status", "counts, hearts per hour, time to the end, reasons of failure");
  status->add_option("STORE", store, "HDF5 file")->required();
  status->add_flag("--watch", watch, "until the campaign ends");
  status->callback([&] { chosen = [&] { return static_cast<ExitCode>(status_command(store, watch)); }; });

  CLI::App* verify = app.add_subcommand("verify", "recompute checksums; a bad row goes back to the queue");
  verify->add_option("STORE", store, "HDF5 file")->required();
  verify->callback([&] { chosen = [&] { return static_cast<ExitCode>(verify_command(store)); }; });

  CLI::App* parameters =
      app.add_subcommand("parameters", "every parameter with unit, value, range and source");
  add_campaign_options(*parameters, options, false);
  parameters->callback([&] { chosen = [&] { return command_parameters(options); }; });

  CLI::App* keys = app.add_subcommand("keys", "every key of a campaign file, as a page of Markdown");
  keys->callback([&] { chosen = [] { return command_keys(); }; });

  CLI::App* devices =
      app.add_subcommand("devices", "every OpenCL device with its memory and measured bandwidth");
  devices->callback([&] { chosen = [] { return command_devices(); }; });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return static_cast<int>(app.exit(error) == 0 ? ExitCode::done : ExitCode::bad_input);
  }
  set_up_log(verbose);
  return static_cast<int>(guarded(ExitCode::bad_input, chosen));
}
