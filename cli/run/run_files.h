// The files of a run: the list, its consistency, and remains of earlier runs.
#pragma once

#include <utility>
#include <vector>

#include "cli/run/run.h"

namespace sim::cli {

// The tables asked for, with their options.
std::vector<std::pair<const char*, const Target*>> tables_of(const RunRequest& request);

bool table_on_standard_output(const RunRequest& request);

// Words give way on standard output to a table that goes there.
std::ostream& words(const RunRequest& request, Console& console);

// All that the run is asked to read and to write, but for what belongs to its scene.
FilePlan plan_of(const RunRequest& request, const std::vector<std::string>& systems = {});
void plan_outputs(const OutRequest& request, const std::vector<std::string>& systems,
                  FilePlan& plan);

// Throws Error{kUsage} for files that would be written over each other, and for tables of no run.
void check_request(const RunRequest& request);

// Removes what killed processes left where this run will write.
void collect_leftovers_of(const RunRequest& request);

}  // namespace sim::cli
