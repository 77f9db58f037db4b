#pragma once
#include <string>
#include <vector>
#include "solver/scene.hpp"
namespace cohort {
struct MechanicsText { std::string generated; std::vector<std::string> files; bool sheets=false; int tension_states=0; };
MechanicsText mechanics_text(const Scene&);
void declare_mechanics(Scene&);
}
