#include "cli/run/run_outputs.h"

#include "cli/terminal/signals.h"
#include "core/base/text.h"
#include "core/scene/memory_estimate.h"

namespace sim::cli {

RunOutputs::RunOutputs(const RunRequest& request, LoadedScene& scene, Registry& registry,
                       Console& console, Progress& progress)
    : request_(request), console_(console), progress_(progress) {
  const auto files = static_cast<int>(request.out.files.size()) + request.out.show;
  for (const SystemSpec& spec : scene.spec.systems) require_room_for_files(spec, files);
  std::vector<const Simulation*> systems;
  for (const Simulation& system : scene.systems) systems.push_back(&system);
  const TableScope scope{systems, scene.spec.world};
  if (request.dump) dump_.emplace(*request.dump, console.out, scope);
  if (request.energy) energy_.emplace(*request.energy, console.out, scope);
  if (request.observe) observe_.emplace(*request.observe, console.out, scope, scene.spec.systems);
  if (request.tension) tension_.emplace(*request.tension, console.out, scope);
  if (request.snap) checkpoints_.emplace(request, scene, console, progress);
  if (!request.out.any()) return;
  recorder_.emplace(request.out, scene, registry);
  recorder_->on_failure([this] { fail(); });
}

void RunOutputs::fail() {
  progress_.clear();
  const int code = report_exception(console_.err);
  if (code_ == 0) code_ = code;
  words_failed_ = words_failed_ || !console_.out.good();
}

bool RunOutputs::deserted() const {
  const bool tables = dump_ || energy_ || observe_ || tension_;
  const bool none = !tables && !request_.snap && !(recorder_ && recorder_->any());
  return code_ == kClosedPipe || (code_ != 0 && none);
}

template <class Use>
bool RunOutputs::attempt(Use use) {
  try {
    use();
    return true;
  } catch (...) {
    fail();
    return false;
  }
}

template <class Table, class Use>
void RunOutputs::use(std::optional<Table>& table, Use use) {
  if (table && !attempt([&] { use(*table); })) table.reset();
}

void RunOutputs::take(std::size_t system, Track& track, bool last) {
  if (recorder_) recorder_->look(system, track, last);
  if (!track.take_frame(last)) return;
  const Simulation& now = track.system();
  use(dump_, [&](DumpTable& table) { table.frame(now); });
  if (now.second_order() && track.energy_is_finite())
    use(energy_,
        [&](EnergyTable& table) { table.row(now, track.energy(), track.work(), track.drift()); });
  use(tension_, [&](TensionTable& table) { table.rows(now); });
  if (!observe_) return;
  const std::span<const double> values = track.observed();
  use(observe_, [&](ObserveTable& table) { table.row(now, track.observers(), values); });
}

void RunOutputs::flush_words() {
  if (!words_failed_) attempt([&] { flush_or_throw(console_.out, "standard output"); });
}

void RunOutputs::look(std::span<const Track> tracks) {
  if (checkpoints_) checkpoints_->look(tracks);
}

void RunOutputs::wrote(const std::string& file) {
  if (file != "-") written_.push_back(file);
}

template <class Table>
void RunOutputs::commit(std::optional<Table>& table, const std::optional<Target>& target) {
  use(table, [&](Table& whole) {
    whole.commit();
    wrote(target->file);
  });
}

void RunOutputs::commit_checkpoint(std::span<const Track> tracks) {
  if (!checkpoints_) return;
  attempt([&] { checkpoints_->keep_diverged(tracks); });
  if (attempt([&] { checkpoints_->commit(tracks); })) wrote(*request_.snap);
}

void RunOutputs::settle(bool diverged) {
  if (checkpoints_) attempt([&] { checkpoints_->settle(diverged); });
}

void RunOutputs::commit_files() {
  commit(dump_, request_.dump);
  commit(energy_, request_.energy);
  commit(observe_, request_.observe);
  commit(tension_, request_.tension);
  if (!recorder_) return;
  SessionSignals::clear();
  for (const std::string& file : recorder_->commit(SessionSignals::any)) wrote(file);
}

void RunOutputs::tell_written() {
  if (code_ == 0 || code_ == static_cast<int>(ErrorKind::kCheck) || written_.empty()) return;
  console_.err << "sim: note: written all the same: " << join(written_, ", ") << '\n' << std::flush;
}

}  // namespace sim::cli
