#include "ensemble/key_reference.hpp"

namespace cohort {

const std::vector<StructureKey>& structure_keys() {
  static const std::vector<StructureKey> keys = {
      {"scene", "map", "required",
       "what is simulated; all sections below but outputs, parameters, campaign "
       "and store stand in it"},
      {"outputs", "map", "required", "what is recorded: any of `ecg`, `activation`, `pv`, `displacement`"},
      {"parameters", "map", "none", "what is sampled: PATH of a parameter and its distribution"},
      {"campaign", "map", "one member", "how many members, how they are sampled, within what limits"},
      {"accuracy", "map of FEATURE: error", "none",
       "the cheapest measured setting that keeps these errors is chosen; none: as the scene says"},
      {"accuracy.FEATURE", "`1 %`, `3 ms` or a number in its unit", "-",
       "largest error of 95 % of members; `%` is of the feature's value"},
      {"accuracy.measurements", "text", "those built in",
       "what `cohort study` has measured of such a scene; relative to the campaign file"},
      {"store", "text", "the file's name with .h5", "HDF5 file; relative to the current folder"},

      {"precision", "`single`, `double`", "`single`", "floating point of the device"},
      {"geometry", "map or `none`", "required; `none` beside `circulation`",
       "one of `heart`, `box`, `shapes`, `labels`; `none`: no tissue, a circulation alone"},
      {"geometry.heart", "map", "-", "the schematic four-chamber heart; its numbers below"},
      {"geometry.box", "map", "-", "a block of tissue from the origin"},
      {"geometry.shapes", "map of NAME: map", "-", "signed distance shapes and set operations on them"},
      {"geometry.shapes.NAME.box", "map", "-", "`centre_mm`, `size_mm`"},
      {"geometry.shapes.NAME.ellipsoid", "map", "-", "`centre_mm`, `semi_axes_mm`"},
      {"geometry.shapes.NAME.cylinder", "map", "-", "`centre_mm`, `axis`, `radius_mm`, `height_mm`"},
      {"geometry.shapes.NAME.cone", "map", "-",
       "`centre_mm`, `axis`, `lower_radius_mm`, `upper_radius_mm`, `height_mm`"},
      {"geometry.shapes.NAME.capsule", "map", "-", "`from_mm`, `to_mm`, `radius_mm`"},
      {"geometry.shapes.NAME.half_space", "map", "-", "`point_mm`, `normal` (outward)"},
      {"geometry.shapes.NAME.union", "list of NAMEs", "-", "of two or more shapes named above"},
      {"geometry.shapes.NAME.intersection", "list of NAMEs", "-", "of two or more shapes named above"},
      {"geometry.shapes.NAME.subtract", "list of NAMEs", "-", "the first without all others"},
      {"geometry.shapes.NAME.smooth_union", "map", "-", "`of` and `smoothing_mm`"},
      {"geometry.shapes.NAME.smooth_union.of", "list of NAMEs", "required", "the shapes it works on"},
      {"geometry.shapes.NAME.shell", "map", "-", "`of` and `thickness_mm`: the surface of one shape"},
      {"geometry.shapes.NAME.shell.of", "NAME", "required", "the shape it works on"},
      {"geometry.regions", "map of NAME: map", "required with shapes",
       "tissues; the first that holds a cell "
       "owns it"},
      {"geometry.regions.NAME.shape", "NAME", "required", "the shape that it fills"},
      {"geometry.regions.NAME.excitable", "`true`, `false`", "`true`", "`false`: it insulates"},
      {"geometry.regions.NAME.bath", "`true`, `false`", "`false`",
       "not excitable, but a conductor around the tissue (bidomain)"},
      {"geometry.regions.NAME.fibres", "`none`, `constant`, `transmural`", "`none`", "rule of its fibres"},
      {"geometry.labels", "text", "-", "NIfTI-1 file, relative to the campaign file"},
      {"geometry.convention", "word", "none",
       "what its values mean: `MM-WHS`, `ACDC`, `TotalSegmentator_heartchambers_highres`, "
       "`Strocchi2020_tags`, `Rodero2021_tags`, `cohort`"},
      {"geometry.labels_table", "map of value: word", "none", "adds to the convention, or stands alone"},
      {"geometry.labels_table.VALUE", "word", "-",
       "blood (`lv_blood`, `rv_blood`, `la_blood`, `ra_blood`, `aorta_blood`, `pulmonary_artery_blood`), "
       "`background`, or the name of a region"},
      {"geometry.frame", "`image`, `heart`", "`image` for `cohort`, else `heart`",
       "whose axes the map is read in"},

      {"electrophysiology", "map", "defaults", "cells, conduction and activation"},
      {"electrophysiology.activation", "`automatic`, `monodomain`, `bidomain`, `reaction_eikonal`, `eikonal`",
       "`automatic`", "what activates the tissue"},
      {"electrophysiology.splitting", "`strang`, `godunov`", "`strang`",
       "of diffusion and reaction in a step; `godunov` is of first order, for comparisons"},
      {"electrophysiology.cell_model", "word", "`mitchell_schaeffer`", "of every region that names no other"},
      {"electrophysiology.regions", "map of NAME: map", "none",
       "what single regions have of their own: `cell_model` and any number that stands right below "
       "`electrophysiology` or in their cell model"},
      {"electrophysiology.regions.NAME.cell_model", "word", "that of `electrophysiology`",
       "the region's own cell model"},
      {"electrophysiology.heterogeneity", "map", "none",
       "cell parameters that vary through walls: PARAMETER, with a slope for each basis"},
      {"electrophysiology.heterogeneity.regions", "list of NAMEs",
       "`lv`, `rv`; of shapes every region with transmural fibres", "where they vary"},
      {"electrophysiology.stretch_activated", "map", "none",
       "mechano-electric feedback: a current of stretched cells; not with eikonal"},
      {"electrophysiology.conduction_system", "map", "none", "drives the heart; heart and label maps"},
      {"electrophysiology.conduction_system.atrioventricular", "`delay`, `path`", "`delay`",
       "early sites after a delay, or a fast path through the insulating septum"},
      {"electrophysiology.conduction_system.early_sites", "map of NAME: map or `off`", "the six named below",
       "where the ventricles start"},
      {"electrophysiology.conduction_system.early_sites.NAME.surface", "`lv`, `rv_septum`, `rv_free_wall`",
       "required for a NAME of your own", "endocardium on which the site lies"},

      {"stimuli", "map of NAME: map", "none", "at most eight, each a `shape` or a `site`"},
      {"stimuli.NAME.shape", "`box`, `sphere`", "-",
       "where it acts, by `lower_mm`, `upper_mm` or `centre_mm`, "
       "`radius_mm`"},
      {"stimuli.NAME.site", "`sinoatrial_node`, `av_node`, `his_bundle`", "-", "a place of the heart"},
      {"torso", "map", "defaults", "needed for an ECG"},
      {"torso.shape", "`cylinder`, `box`, `ellipsoid`, `unbounded`", "`cylinder`", "of the body"},

      {"mechanics", "map", "of the heart; else none",
       "deforming tissue, where an output needs it; heart, label maps and shapes"},
      {"mechanics.law", "word", "`guccione`", "of the passive tissue; a file of `kernels/laws`"},
      {"mechanics.tension", "word or `none`", "`twitch` in the heart, else `none`",
       "active tension along fibres; a file of `kernels/tension`"},
      {"mechanics.cavities", "list of chambers, or map of NAME: map", "[lv, rv] of the heart",
       "blood within the tissue: any of `lv`, `rv`, `la`, `ra` of a heart or label map, whose walls deform; "
       "of "
       "shapes by name"},
      {"mechanics.cavities.NAME.shape", "NAME", "required", "the shape that it fills"},
      {"mechanics.cavities.NAME.pressure", "`constant`, `bestel`", "`constant`",
       "without a circulation: a number, or by the equation of the tension `bestel`"},
      {"mechanics.boundary", "map of NAME: map",
       "of the heart's ventricles `base`, `base_ring`, `epicardium`, of its atria `atrial_base`, "
       "`atrial_ring`, "
       "`atrial_epicardium`, `great_vessels`",
       "conditions on surfaces; `{}`: none"},
      {"mechanics.boundary.NAME.surface", "NAME", "required",
       "a shape, or of the heart `base`, `epicardium`, `lv_endocardium`, `rv_endocardium`; where atria "
       "deform "
       "`atrial_base`, `atrial_epicardium`, `great_vessels`, `la_endocardium`, `ra_endocardium`"},
      {"mechanics.boundary.NAME.clamp", "`all`, `normal`", "-", "it stays, or stays in its plane"},
      {"mechanics.boundary.NAME.spring", "`full`, `normal`", "-",
       "springs and dashpots, in all directions or along the normal"},
      {"mechanics.quasi_static", "`true`, `false`", "`false`",
       "the equilibrium under the final loads; without a circulation"},
      {"mechanics.regions", "map of NAME: map", "none",
       "what single regions have of their own: any number of the law, the tension, `bulk_modulus_kPa`, "
       "`viscosity_kPa_ms`"},
      {"circulation", "map or `none`",
       "`closed_loop` of the heart and of label maps with mechanics; else none",
       "what the chambers are joined to, where an output needs it"},
      {"circulation.kind", "`closed_loop`, `windkessel`", "`closed_loop`",
       "all four chambers (Regazzoni et al. 2022), or three elements behind the left ventricle"},
      {"time.beats", "map", "none",
       "beats until two agree, of which the last is recorded; in place of `end_ms`"},

      {"outputs.ecg", "map", "none", "twelve leads"},
      {"outputs.ecg.leads", "`12`", "`12`", "there are no others"},
      {"outputs.ecg.method", "`lead_field`, `forward`", "`lead_field`",
       "a solve for each electrode, or one at every sample"},
      {"outputs.activation", "map", "none", "activation times of regions and probes"},
      {"outputs.activation.beats", "`true`, `false`", "`false`", "also counts beats, APD90, intervals"},
      {"outputs.activation.probes", "map of NAME_mm: [x, y, z]", "none", "single places"},
      {"outputs.pv", "map", "none",
       "pressure and volume of chambers and arteries, and features of their loops"},
      {"outputs.displacement", "map", "none", "displacement of points of the tissue"},
      {"outputs.displacement.points", "map of NAME_mm: [x, y, z]", "required",
       "their places before any load"},
      {"outputs.flow", "-", "-", "known, not built yet: refused"},

      {"parameters.PATH.uniform", "[a, b]", "-", "uniform in the interval"},
      {"parameters.PATH.log_uniform", "[a, b]", "-", "uniform in the logarithm; a > 0"},
      {"parameters.PATH.normal", "[mean, deviation]", "-", "normal, cut at `bounds`"},
      {"parameters.PATH.bounds", "[a, b]", "the parameter's range", "of a normal distribution"},
      {"parameters.PATH.choice", "list of numbers", "-", "each as often"},

      {"campaign.members", "whole number, 1 to 10000000",
       "1; required where something is sampled; rows of "
       "the points",
       "how many hearts"},
      {"campaign.method", "`sobol`, `latin_hypercube`, `grid`, `monte_carlo`, `csv`", "`sobol`",
       "how they are sampled"},
      {"campaign.seed", "whole number", "0", "of the random numbers"},
      {"campaign.points", "text", "required with `csv`", "CSV of the members, relative to the campaign file"},
      {"campaign.check_fraction", "number, 0 to 1", "0.02",
       "of the members, rounded, and 3 at least if it comes to any, run again at half the spacing and the "
       "step: "
       "`/members/error_estimate`; 0: none"},
      {"campaign.timeout_s", "number, s", "3600", "of one member; a check has 32 times as long"},
      {"campaign.retries", "whole number", "0",
       "further attempts of a member that failed or ran out of time, and as many, three at most, with half "
       "the "
       "steps each of one that ended unstable"},
      {"campaign.members_per_device", "whole number, at least 1", "by size", "members in one launch"},
      {"campaign.memory_limit_GB", "number, GB", "what the device has", "memory of the device to use"},
  };
  return keys;
}

}  // namespace cohort
