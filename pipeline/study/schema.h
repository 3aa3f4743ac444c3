// SPDX-License-Identifier: GPL-3.0-or-later
// The JSON schema of studies, as pipeline/scene/schema.h has that of scenes. (pipeline/study/README.md)
#pragma once

#include "pipeline/scene/schema.h"

namespace toile {

nlohmann::ordered_json study_schema();
std::span<const KeyWords> study_words();

}  // namespace toile
