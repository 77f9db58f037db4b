// Label values of public whole-heart segmentations.
//   MM-WHS: X. Zhuang and J. Shen, Med. Image Anal. 31 (2016) and the challenge's notes; 421 in one training
//   case
//     means 420. Its only wall is the left ventricle's.
//   ACDC: O. Bernard et al., IEEE Trans. Med. Imaging 37 (2018). Ventricles only.
//   TotalSegmentator, task heartchambers_highres: J. Wasserthal et al., Radiology: AI 5 (2023). Its
//   myocardium is
//     the left ventricle's wall with the septum.
//   Strocchi2020: M. Strocchi et al., PLoS ONE 15(6), e0235145 (2020). Rodero2021: C. Rodero et al., PLoS
//   Comput.
//     Biol. 17(4), e1008851 (2021). Tags of the elements of meshes, here of voxels filled from such meshes:
//     walls, and planes that close the valves. Their blood has no tag: what walls and planes enclose is taken
//     for it.
#include "solver/label_conventions.hpp"

#include <algorithm>
#include <stdexcept>

namespace cohort {

namespace {

LabelTable cohort_table() {
  LabelTable table = {{0, "background"}};
  std::int32_t code = 1;
  for (const char* region : heart_regions) table[code++] = region;
  code = first_blood_label;
  for (const char* blood : blood_names) table[code++] = blood;
  return table;
}

LabelTable mesh_tags(std::int32_t first_plane) {
  LabelTable table = {{0, "background"},      {1, "lv"}, {2, "rv"}, {3, "la"}, {4, "ra"}, {5, "aorta"},
                      {6, "pulmonary_artery"}};
  for (std::int32_t plane = 0; plane < 4; ++plane) table[first_plane + plane] = "insulator";
  return table;
}

const std::map<std::string, LabelTable>& tables() {
  static const std::map<std::string, LabelTable> all = {
      {"MM-WHS",
       {{0, "background"},
        {500, "lv_blood"},
        {600, "rv_blood"},
        {420, "la_blood"},
        {421, "la_blood"},
        {550, "ra_blood"},
        {205, "lv"},
        {820, "aorta_blood"},
        {850, "pulmonary_artery_blood"}}},
      {"ACDC", {{0, "background"}, {1, "rv_blood"}, {2, "lv"}, {3, "lv_blood"}}},
      {"TotalSegmentator_heartchambers_highres",
       {{0, "background"},
        {1, "lv"},
        {2, "la_blood"},
        {3, "lv_blood"},
        {4, "ra_blood"},
        {5, "rv_blood"},
        {6, "aorta_blood"},
        {7, "pulmonary_artery_blood"}}},
      {"Strocchi2020_tags", mesh_tags(14)},
      {"Rodero2021_tags", mesh_tags(7)},
      {"cohort", cohort_table()},
  };
  return all;
}

}  // namespace

std::vector<std::string> label_conventions() {
  std::vector<std::string> names;
  for (const auto& [name, table] : tables()) names.push_back(name);
  return names;
}

LabelTable label_table(const std::string& convention) {
  const auto it = tables().find(convention);
  if (it == tables().end()) throw std::invalid_argument("no label convention \"" + convention + "\"");
  return it->second;
}

}  // namespace cohort
