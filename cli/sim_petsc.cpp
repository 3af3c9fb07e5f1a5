// sim-petsc: makes the steps of the scene that sim wrote into this folder, on any number of
// processes, with PETSc. `sim SCENE --engine petsc` starts it.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "cli/petsc_stepper.h"

namespace {

namespace engine = sim::engine;
using sim::petsc::Scene;
using sim::petsc::Stepper;

class Log {
 public:
  explicit Log(bool mine) : file_(mine ? std::fopen(engine::kPetscLog, "w") : nullptr) {}
  ~Log() {
    if (file_) std::fclose(file_);
  }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;
  void say(const std::string& line) {
    if (!file_) return;
    std::fprintf(file_, "%s\n", line.c_str());
    std::fflush(file_);
  }

 private:
  std::FILE* file_;
};

PetscErrorCode run(Log& log, int rank, int ranks) {
  PetscFunctionBeginUser;
  Scene scene;
  int good = read_scene(scene, rank, ranks);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &good, 1, MPI_INT, MPI_MIN, PETSC_COMM_WORLD));
  if (!good) {
    log.say(std::string("ERROR: ") + engine::kPetscScene + " is not here, or not whole");
    PetscFunctionReturn(0);
  }
  int file = -1;
  if (rank == 0) ::close(::open(engine::kPetscFrames, O_WRONLY | O_CREAT | O_TRUNC, 0666));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  file = ::open(engine::kPetscFrames, O_WRONLY | O_CLOEXEC);
  Stepper stepper(scene);
  PetscCall(stepper.set_up());
  const std::int64_t start = scene.head.start;
  std::size_t next = 1;  // the first frame is the scene itself
  for (std::int64_t step = start; next < scene.moments.size(); ++step) {
    // Solved so accurately that the error of the method is unaffected.
    constexpr double kExact = 1e-12, kEnough = 1e-8;
    double tolerance = scene.head.tolerance > 0 ? scene.head.tolerance : kEnough;
    if (step - start < scene.head.exact_steps) tolerance = std::min(tolerance, kExact);
    bool solved = false;
    PetscCall(stepper.step(tolerance, solved));
    if (!solved) {
      log.say("halted " + std::to_string(step) + " the step has no solution in reach");
      break;
    }
    if (scene.moments[next] != step + 1) continue;
    PetscCall(stepper.write(file, static_cast<std::int64_t>(next) - 1, step + 1));
    ++next;
  }
  PetscCall(stepper.tear_down());
  if (file >= 0) ::close(file);
  PetscFunctionReturn(0);
}

}  // namespace

int main(int argc, char** argv) {
  if (PetscInitialize(&argc, &argv, nullptr, nullptr) != 0) return 1;
  PetscMPIInt rank = 0, ranks = 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  Log log(rank == 0);
  log.say("PETSc " + std::to_string(PETSC_VERSION_MAJOR) + "." +
          std::to_string(PETSC_VERSION_MINOR) + "." + std::to_string(PETSC_VERSION_SUBMINOR) +
          ", " + std::to_string(ranks) + (ranks == 1 ? " rank" : " ranks"));
  const PetscErrorCode failed = run(log, rank, ranks);
  if (failed) {
    const char* why = nullptr;
    PetscErrorMessage(failed, &why, nullptr);
    log.say(std::string("ERROR: PETSc: ") + (why ? why : "it failed"));
    MPI_Abort(PETSC_COMM_WORLD, 1);
  }
  return PetscFinalize() == 0 ? 0 : 1;
}
