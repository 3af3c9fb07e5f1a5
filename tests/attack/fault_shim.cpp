// A library to be loaded before the C library: one call of a program fails. $SIM_FAULT says which:
// CALL:N:HOW makes the call of number N of a kind fail, CALL:N+:HOW that one and all after it.
// Calls are counted from main on, with those of forked processes; programs that it starts are left
// alone. HOW is the name of an error, or for write also "short" (half of the bytes).
// $SIM_FAULT_REPORT names a file that says afterwards how many calls there were and what made the
// one that failed.
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace {

enum Call {
  kWrite,
  kRead,
  kSync,
  kRename,
  kLink,
  kOpen,
  kCreate,
  kMmap,
  kThread,
  kMalloc,
  kFork,
  kPipe,
  kFolder,
  kTruncate,
  kNone
};

constexpr const char* kNames[] = {"write", "read",   "fsync", "rename",  "linkat",
                                  "open",  "create", "mmap",  "thread",  "malloc",
                                  "fork",  "pipe",   "mkdir", "truncate"};

struct Named {
  const char* name;
  int value;
};

constexpr Named kErrors[] = {{"ENOSPC", ENOSPC}, {"EIO", EIO},     {"EMFILE", EMFILE},
                             {"ENOMEM", ENOMEM}, {"EINTR", EINTR}, {"EAGAIN", EAGAIN},
                             {"EACCES", EACCES}, {"EROFS", EROFS}, {"EDQUOT", EDQUOT},
                             {"EXDEV", EXDEV},   {"EPERM", EPERM}, {"EOPNOTSUPP", EOPNOTSUPP},
                             {"short", 0}};

constexpr int kFrames = 48;

// The file of the report; the driver reads it by these offsets.
struct Report {
  std::atomic<long> count, failed;
  long frames;
  char frame[kFrames][112];  // file+offset
};

Report own_report;
Report* report = &own_report;
std::atomic<bool> begun{false};
Call call_to_fail = kNone;
long first = 0;
bool for_ever = false;
int error_of_failure = 0;
bool short_write = false;
thread_local bool inside = false;

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

void write_number(char*& at, char* end, unsigned long number) {
  char digits[20];
  int length = 0;
  do {
    digits[length++] = "0123456789abcdef"[number % 16];
    number /= 16;
  } while (number > 0);
  while (length > 0 && at < end) *at++ = digits[--length];
}

// The callers of the call that fails, found without a call that could fail itself.
void report_frames() {
  void* addresses[kFrames];
  const int found = ::backtrace(addresses, kFrames);
  for (int i = 0; i < found; ++i) {
    char* at = report->frame[i];
    char* const end = at + sizeof report->frame[i] - 1;
    Dl_info info{};
    if (::dladdr(addresses[i], &info) == 0 || !info.dli_fname) continue;
    const char* name = std::strrchr(info.dli_fname, '/');
    for (name = name ? name + 1 : info.dli_fname; *name && at < end - 20; ++name) *at++ = *name;
    *at++ = '+';
    write_number(at, end,
                 static_cast<unsigned long>(static_cast<char*>(addresses[i]) -
                                            static_cast<char*>(info.dli_fbase)));
    *at = 0;
  }
  report->frames = found;
}

// True when this call is one to fail; errno is set then.
bool fails(Call call) {
  if (call != call_to_fail || !begun.load(std::memory_order_relaxed) || inside) return false;
  const long number = report->count.fetch_add(1, std::memory_order_relaxed) + 1;
  if (first == 0 || (for_ever ? number < first : number != first)) return false;
  inside = true;
  if (report->failed.fetch_add(1, std::memory_order_relaxed) == 0) report_frames();
  inside = false;
  errno = error_of_failure;
  return true;
}

void read_orders(const char* text) {
  const char* const colon = std::strchr(text, ':');
  if (!colon) return;
  for (int call = 0; call < kNone; ++call)
    if (std::strlen(kNames[call]) == static_cast<std::size_t>(colon - text) &&
        std::strncmp(kNames[call], text, static_cast<std::size_t>(colon - text)) == 0)
      call_to_fail = static_cast<Call>(call);
  char* rest = nullptr;
  first = std::strtol(colon + 1, &rest, 10);
  for_ever = *rest == '+';
  const char* const how = std::strchr(rest, ':');
  for (const Named& error : kErrors)
    if (how && std::strcmp(error.name, how + 1) == 0) error_of_failure = error.value;
  short_write = how && std::strcmp(how + 1, "short") == 0;
}

void map_report(const char* file) {
  const long descriptor = ::syscall(SYS_openat, AT_FDCWD, file, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor < 0) return;
  if (::syscall(SYS_ftruncate, descriptor, sizeof(Report)) == 0) {
    const long memory = ::syscall(SYS_mmap, nullptr, sizeof(Report), PROT_READ | PROT_WRITE,
                                  MAP_SHARED, descriptor, 0);
    if (memory > 0) report = reinterpret_cast<Report*>(memory);
  }
  ::syscall(SYS_close, descriptor);
}

int (*program)(int, char**, char**) = nullptr;

int begin_program(int argc, char** argv, char** environment) {
  if (const char* file = std::getenv("SIM_FAULT_REPORT")) map_report(file);
  if (const char* text = std::getenv("SIM_FAULT")) read_orders(text);
  for (const char* name : {"LD_PRELOAD", "SIM_FAULT", "SIM_FAULT_REPORT"}) ::unsetenv(name);
  void* address = nullptr;
  ::backtrace(&address, 1);  // the first one loads a library
  begun = true;
  return program(argc, argv, environment);
}

std::size_t half(std::size_t size) { return (size + 1) / 2; }

bool creates(int flags) { return (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE; }

// Standard error is spared: it is where the failure is said.
bool write_fails(int descriptor) { return descriptor != STDERR_FILENO && fails(kWrite); }

}  // namespace

#define SIM_EXPORT __attribute__((visibility("default")))

extern "C" {

SIM_EXPORT int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv,
                                 void (*init)(), void (*fini)(), void (*rtld_fini)(), void* stack) {
  program = main;
  return next<decltype(__libc_start_main)>("__libc_start_main")(begin_program, argc, argv, init,
                                                                fini, rtld_fini, stack);
}

SIM_EXPORT ssize_t write(int descriptor, const void* data, size_t size) {
  static auto* const real = next<decltype(write)>("write");
  if (!write_fails(descriptor)) return real(descriptor, data, size);
  return short_write ? real(descriptor, data, half(size)) : -1;
}

SIM_EXPORT ssize_t pwrite(int descriptor, const void* data, size_t size, off_t at) {
  static auto* const real = next<decltype(pwrite)>("pwrite");
  if (!write_fails(descriptor)) return real(descriptor, data, size, at);
  return short_write ? real(descriptor, data, half(size), at) : -1;
}

SIM_EXPORT ssize_t pwrite64(int descriptor, const void* data, size_t size, off64_t at) {
  return pwrite(descriptor, data, size, at);
}

SIM_EXPORT ssize_t writev(int descriptor, const iovec* parts, int number) {
  static auto* const real = next<decltype(writev)>("writev");
  if (!write_fails(descriptor)) return real(descriptor, parts, number);
  if (!short_write) return -1;
  const iovec* const part =
      std::find_if(parts, parts + number - 1, [](const iovec& each) { return each.iov_len > 0; });
  return ::syscall(SYS_write, descriptor, part->iov_base, half(part->iov_len));
}

SIM_EXPORT ssize_t read(int descriptor, void* data, size_t size) {
  static auto* const real = next<decltype(read)>("read");
  return fails(kRead) ? -1 : real(descriptor, data, size);
}

SIM_EXPORT ssize_t pread(int descriptor, void* data, size_t size, off_t at) {
  static auto* const real = next<decltype(pread)>("pread");
  return fails(kRead) ? -1 : real(descriptor, data, size, at);
}

SIM_EXPORT int fsync(int descriptor) {
  static auto* const real = next<decltype(fsync)>("fsync");
  return fails(kSync) ? -1 : real(descriptor);
}

SIM_EXPORT int fdatasync(int descriptor) {
  static auto* const real = next<decltype(fdatasync)>("fdatasync");
  return fails(kSync) ? -1 : real(descriptor);
}

SIM_EXPORT int rename(const char* from, const char* to) {
  static auto* const real = next<decltype(rename)>("rename");
  return fails(kRename) ? -1 : real(from, to);
}

SIM_EXPORT int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  static auto* const real = next<decltype(renameat)>("renameat");
  return fails(kRename) ? -1 : real(from_folder, from, to_folder, to);
}

SIM_EXPORT int renameat2(int from_folder, const char* from, int to_folder, const char* to,
                         unsigned flags) {
  static auto* const real = next<decltype(renameat2)>("renameat2");
  return fails(kRename) ? -1 : real(from_folder, from, to_folder, to, flags);
}

SIM_EXPORT int link(const char* from, const char* to) {
  static auto* const real = next<decltype(link)>("link");
  return fails(kLink) ? -1 : real(from, to);
}

SIM_EXPORT int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  static auto* const real = next<decltype(linkat)>("linkat");
  return fails(kLink) ? -1 : real(from_folder, from, to_folder, to, flags);
}

SIM_EXPORT int openat(int folder, const char* name, int flags, ...) {
  static auto* const real = next<int(int, const char*, int, mode_t)>("openat");
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = creates(flags) ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return fails(creates(flags) ? kCreate : kOpen) ? -1 : real(folder, name, flags, mode);
}

SIM_EXPORT int open(const char* name, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = creates(flags) ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return openat(AT_FDCWD, name, flags, mode);
}

SIM_EXPORT int mkostemp(char* name, int flags) {
  static auto* const real = next<decltype(mkostemp)>("mkostemp");
  return fails(kCreate) ? -1 : real(name, flags);
}

SIM_EXPORT FILE* fopen(const char* name, const char* mode) {
  static auto* const real = next<decltype(fopen)>("fopen");
  return fails(mode[0] == 'r' ? kOpen : kCreate) ? nullptr : real(name, mode);
}

SIM_EXPORT FILE* fopen64(const char* name, const char* mode) { return fopen(name, mode); }

SIM_EXPORT void* mmap(void* where, size_t size, int protection, int flags, int descriptor,
                      off_t at) {
  static auto* const real = next<decltype(mmap)>("mmap");
  return fails(kMmap) ? MAP_FAILED : real(where, size, protection, flags, descriptor, at);
}

SIM_EXPORT void* mmap64(void* where, size_t size, int protection, int flags, int descriptor,
                        off64_t at) {
  return mmap(where, size, protection, flags, descriptor, at);
}

SIM_EXPORT int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*work)(void*), void* argument) {
  static auto* const real = next<decltype(pthread_create)>("pthread_create");
  return fails(kThread) ? error_of_failure : real(thread, attributes, work, argument);
}

SIM_EXPORT pid_t fork() {
  static auto* const real = next<pid_t()>("fork");
  return fails(kFork) ? -1 : real();
}

SIM_EXPORT int pipe2(int* ends, int flags) {
  static auto* const real = next<decltype(pipe2)>("pipe2");
  return fails(kPipe) ? -1 : real(ends, flags);
}

SIM_EXPORT int pipe(int* ends) {
  static auto* const real = next<decltype(pipe)>("pipe");
  return fails(kPipe) ? -1 : real(ends);
}

SIM_EXPORT int mkdir(const char* name, mode_t mode) {
  static auto* const real = next<decltype(mkdir)>("mkdir");
  return fails(kFolder) ? -1 : real(name, mode);
}

SIM_EXPORT char* mkdtemp(char* name) {
  static auto* const real = next<decltype(mkdtemp)>("mkdtemp");
  return fails(kFolder) ? nullptr : real(name);
}

SIM_EXPORT int ftruncate(int descriptor, off_t size) {
  static auto* const real = next<decltype(ftruncate)>("ftruncate");
  return fails(kTruncate) ? -1 : real(descriptor, size);
}

void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);

SIM_EXPORT void* malloc(size_t size) { return fails(kMalloc) ? nullptr : __libc_malloc(size); }

SIM_EXPORT void* calloc(size_t number, size_t size) {
  return fails(kMalloc) ? nullptr : __libc_calloc(number, size);
}

SIM_EXPORT void* realloc(void* memory, size_t size) {
  return fails(kMalloc) ? nullptr : __libc_realloc(memory, size);
}

SIM_EXPORT void* aligned_alloc(size_t alignment, size_t size) {
  return fails(kMalloc) ? nullptr : __libc_memalign(alignment, size);
}

SIM_EXPORT int posix_memalign(void** memory, size_t alignment, size_t size) {
  if (fails(kMalloc)) return ENOMEM;
  *memory = __libc_memalign(alignment, size);
  return *memory ? 0 : ENOMEM;
}

}  // extern "C"
