#pragma once

#include <string>
#include <vector>

#include "ensemble/campaign.hpp"
#include "ensemble/document.hpp"

// The parts of read_campaign, one for each section of the file. All add to `mistakes` and never throw.
namespace cohort {

/// Applies "key=value" of the how-many-th --set to the tree of a campaign file or, where the key begins with
/// the section of a kind of study, of a study file.
void apply_override(Node& root, const std::string& assignment, int number, Mistakes& mistakes);

/// Adds "--set:1: path why" where a --set gave the parameter `path` its value. Either node may be null.
void refuse_set(Node* scene, Node* outputs, const std::string& path, const std::string& why,
                Mistakes& mistakes);

/// Reads the structure below `scene` and `outputs` into the fields of `scene`; numbers are left for
/// read_parameters. Either node may be null. `file`: the campaign file, to which relative paths relate.
void read_structure(Node* scene_node, Node* outputs_node, const std::string& file, Scene& scene,
                    Mistakes& mistakes);

/// Reads the label map that `geometry` names, and what its values mean, into scene.labels.
void read_labels(Node& geometry, const std::string& file, Scene& scene, Mistakes& mistakes);

/// The part of read_structure for `electrophysiology`; needs the structure of the geometry.
void read_electrophysiology(Node& electrophysiology, Scene& scene, Mistakes& mistakes);

/// The part of read_structure for `outputs`.
void read_outputs(Node& outputs, Scene& scene, Mistakes& mistakes);

/// The part of read_structure for `mechanics`, `circulation` and `time.beats`; needs the structure of the
/// geometry and of the outputs. The scene has them even where no output does: leave_out_loads.
void read_loads(Node& scene_node, Node* outputs, Scene& scene, Mistakes& mistakes);

/// Reads scene.electrophysiology.conduction_system, before the regions, which depend on it.
void read_conduction_system(Node& node, Scene& scene, Mistakes& mistakes);

/// Sets the parameters of the table that stand below `map`, and adds a mistake for each key that is neither
/// structure nor a parameter.
void read_parameters(Node& map, ParameterTable& table, Mistakes& mistakes);

/// Reads `parameters`: the distribution of each sampled parameter, but for those below the levels `aside`,
/// which the table lacks because of other mistakes.
void read_sampled(Node& map, const std::vector<std::string>& aside, Campaign& campaign, Mistakes& mistakes);

/// The parameter that the key of `entry` names, or null after a mistake: the scene has none of that name, or
/// all members share it.
const Parameter* read_path(const Node::Entry& entry, const Scene& scene, Mistakes& mistakes);

/// Reads `campaign`: how many members, how they are sampled, within what limits. `map` may be null.
/// `complete`: whether the table has every parameter of the scene; else the points are not looked at.
/// Returns the line that the points add to the campaign's text, or nothing.
std::string read_campaign_section(Node* map, const std::string& file, bool complete, Campaign& campaign,
                                  Mistakes& mistakes);

}  // namespace cohort
