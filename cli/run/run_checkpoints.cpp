#include "cli/run/run_checkpoints.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "core/base/error.h"
#include "core/output/file_plan.h"
#include "core/output/format.h"
#include "core/output/output.h"

namespace sim::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kInterval = 15 * 60;     // s, where nothing else is asked for
constexpr double kLongestInterval = 1e9;  // s, that clocks can count

[[noreturn]] void fail(const std::string& what, const std::string& file, const std::string& why) {
  throw Error(ErrorKind::kIo,
              {what, file, why, "check the folder, its permissions and the space there"});
}

void copy_file(const fs::path& from, const std::string& to) {
  std::ifstream in(from, std::ios::binary);
  Output out(to);
  std::vector<char> block(std::size_t{1} << 16);
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())), in.gcount() > 0) {
    out.buffer().append(block.data(), static_cast<std::size_t>(in.gcount()));
    out.flush_if_full();
  }
  if (in.bad() || !in.eof()) fail("cannot keep the older checkpoint", to, "reading it failed");
  out.commit_safely();
}

// Adds a second name to a file, replacing its former owner. False if the system cannot do that.
bool link_over(const fs::path& file, const fs::path& name) {
  fs::path made;
  const int reserved = open_temporary(name.parent_path(), "", made);
  if (reserved < 0) return false;
  const bool linked = ::unlink(made.c_str()) == 0 && ::link(file.c_str(), made.c_str()) == 0 &&
                      ::rename(made.c_str(), name.c_str()) == 0;
  ::unlink(made.c_str());
  ::close(reserved);
  return linked;
}

}  // namespace

std::vector<std::string> names_beside_checkpoint(const std::string& file) {
  if (is_stream(file)) return {};
  return {file + ".prev", file + ".diverged"};
}

RunCheckpoints::RunCheckpoints(const RunRequest& request, LoadedScene& scene, Console& console,
                               Progress& progress)
    : request_(request),
      scene_(scene),
      console_(console),
      progress_(progress),
      file_(*request.snap),
      interval_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
          std::min(request.snap_every.value_or(kInterval), kLongestInterval)))),
      next_(Clock::now() + interval_) {
  const std::vector<std::string> names = names_beside_checkpoint(file_);
  if (names.empty()) return;
  previous_ = names[0];
  diverged_ = names[1];
  // Errors that can be found now are reported before the first step.
  for (const std::string& name : {file_, previous_, diverged_}) Output{name};
}

// Writing may take a hundredth of the run's time.
void RunCheckpoints::keep_good(std::span<const Track> tracks) {
  constexpr auto kAtOnce = std::chrono::milliseconds(20);
  const auto now = Clock::now();
  if (good_ && spent_ + last_ > kAtOnce + (now - begin_) / 100) return;
  try {
    auto made = make_checkpoint(file_, request_.scene, scene_, accounts_of(tracks), console_.out);
    made->write();
    good_ = std::move(made);
    good_t_ = scene_.systems.front().t();
  } catch (const Error&) {
    // The previous one serves.
  }
  last_ = Clock::now() - now;
  spent_ += last_;
}

void RunCheckpoints::look(std::span<const Track> tracks) {
  if (previous_.empty()) return;
  if (std::ranges::any_of(tracks, &Track::looked) && std::ranges::all_of(tracks, &Track::sound))
    keep_good(tracks);
  if (Clock::now() < next_ || std::ranges::any_of(tracks, &Track::diverges)) return;
  try {
    write(accounts_of(tracks));
  } catch (const Error& error) {
    progress_.clear();
    console_.err << "sim: warning: no checkpoint now: " << error.what() << '\n' << std::flush;
  }
  next_ = Clock::now() + interval_;
}

// Neither name is ever missing: the older file gets a second one, then the first is replaced.
void RunCheckpoints::keep_previous() {
  if (std::exchange(replaced_, true) || previous_.empty()) return;
  const fs::path file = resolved_file(file_), previous = resolved_file(previous_);
  std::error_code failed;
  if (!fs::exists(file, failed)) return;
  try {
    if (!link_over(file, previous)) copy_file(file, previous_);
  } catch (...) {
    replaced_ = false;
    throw;
  }
}

// Repeats a call once, as system calls may fail transiently.
void RunCheckpoints::write(const std::vector<Account>& accounts) {
  for (bool again = false;; again = true) {
    try {
      keep_previous();
      return save_checkpoint(file_, request_.scene, scene_, accounts, console_.out);
    } catch (const Error& error) {
      if (again || error.kind() != ErrorKind::kIo) throw;
    }
  }
}

void RunCheckpoints::keep_diverged(std::span<const Track> tracks) {
  is_diverged_ = !diverged_.empty() && std::ranges::any_of(tracks, &Track::diverges);
  if (is_diverged_)
    save_checkpoint(diverged_, request_.scene, scene_, accounts_of(tracks), console_.out);
}

void RunCheckpoints::commit(std::span<const Track> tracks) {
  if (is_diverged_ && good_)
    commit_good();
  else
    write(accounts_of(tracks));
}

void RunCheckpoints::commit_good() {
  keep_previous();
  good_->commit_safely();
  console_.err << "sim: note: " << file_ << " has the last good state, at t = " << brief(good_t_)
               << " s; the one that diverged is in " << diverged_ << '\n'
               << std::flush;
}

void RunCheckpoints::settle(bool diverged) {
  if (diverged || !is_diverged_) return;
  if (::rename(resolved_file(diverged_).c_str(), resolved_file(file_).c_str()) != 0)
    fail("cannot replace the checkpoint", file_, std::strerror(errno));
  console_.err << "sim: note: " << file_ << " has the last state, which did not diverge\n"
               << std::flush;
}

}  // namespace sim::cli
