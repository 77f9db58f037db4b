#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cohort {

struct Campaign;
class Ranks;

/// What the program returns to the shell.
enum class ExitCode : int {
  done = 0,         ///< all members done
  bad_input = 1,    ///< nothing ran
  failed = 2,       ///< finished, with members that failed
  interrupted = 3,  ///< stopped before the end; the same command goes on
};

/// What the command line says about a campaign.
struct CampaignOptions {
  std::string file;
  std::vector<std::string> overrides;  ///< "key=value" of each --set, in order
  std::string store;                   ///< --store, or empty
  std::string device;                  ///< --device, or empty
  std::vector<std::string> exports;    ///< each --export, in order: what to write of one member
  std::int64_t export_member = 0;      ///< --member
  double export_every_ms = 10;         ///< --export-every
  double export_spacing_mm = 0;        ///< --export-spacing; 0: half of grid.dx_mm
  bool quick = false;                  ///< of plan: nothing is run
};

// One function for each command (those of status and verify are in status.hpp); returns the exit code. Bad
// input is thrown as ConfigError or std::runtime_error; what goes wrong once members run is told and returned
// as ExitCode::interrupted.
ExitCode command_run(const CampaignOptions& options);
/// Runs what is unfinished of a campaign, on all ranks; `device` as in CampaignOptions. Every rank has the
/// same campaign. From the first member on errors are told and returned as ExitCode::interrupted.
ExitCode run_campaign(const Ranks& ranks, const Campaign& campaign, const std::string& device);
ExitCode command_export(const CampaignOptions& options);
ExitCode command_plan(const CampaignOptions& options);
/// Runs a study file (study.hpp).
ExitCode command_study(const CampaignOptions& options);
ExitCode command_parameters(const CampaignOptions& options);
ExitCode command_devices();
/// Prints configs/keys.md.
ExitCode command_keys();

}  // namespace cohort
