// Writers of files, by the endings of their names.
#pragma once

#include <memory>
#include <string>

#include "core/output/writer.h"
#include "core/plugin/registry.h"

namespace sim {

// Throws Error{kUsage} for an ending of no writer.
const Plugin<Writer>& writer_of(const std::string& file, Registry& registry);

// A writer for task.file, whose name gives the format. Throws the errors of the writer.
std::unique_ptr<Writer> make_writer(WriterTask task, Registry& registry);

// The look of the first system that has one, overridden by the user's options.
Look look_of(const SceneSpec& scene, const LookSpec& asked);

}  // namespace sim
