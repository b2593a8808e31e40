#pragma once

#include <string>

#include "deepuav/assembly/output/run_facts.h"

namespace deepuav {

/// The summary.json of a run's output folder.
std::string SummaryText(const Atlas& atlas, const SlamResult& result, const RunFacts& facts);

}  // namespace deepuav
