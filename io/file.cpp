// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "geometry/error.h"

namespace toile {

namespace {

std::string reason() {
  return std::generic_category().message(errno);
}

struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

int nameless_file(const std::filesystem::path& folder) {
#ifdef O_TMPFILE
  if (::access("/proc/self/fd", X_OK) == 0) return ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
#endif
  (void)folder;
  return -1;
}

// Links a nameless file to a name like `wanted`, with the last letters chosen anew until nothing is there.
bool give_name(int fd, std::string& wanted) {
  const std::string source = "/proc/self/fd/" + std::to_string(fd);
  const std::string stem = wanted.substr(0, wanted.rfind('.') + 1) + std::to_string(::getpid()) + "-";
  for (int k = 0; k < 1000; ++k) {
    wanted = stem + std::to_string(k);
    if (::linkat(AT_FDCWD, source.c_str(), AT_FDCWD, wanted.c_str(), AT_SYMLINK_FOLLOW) == 0) return true;
    if (errno != EEXIST) break;
  }
  wanted.clear();
  return false;
}

}  // namespace

std::string read_file(const std::filesystem::path& path, std::uintmax_t limit) {
  const std::string name = path.string();
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  if (file.fd < 0) throw InputError(name + ": " + reason());
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) throw InputError(name + ": " + reason());
  if (S_ISDIR(status.st_mode)) throw InputError(name + ": it is a directory, must be a file");
  auto too_large = [&] { return InputError(name + ": the file is larger than " + std::to_string(limit) + " bytes"); };
  if (S_ISREG(status.st_mode) && static_cast<std::uintmax_t>(status.st_size) > limit) throw too_large();

  // Pipes and growing files have no size to trust: read until the end.
  std::string bytes;
  std::size_t used = 0;
  bytes.resize(S_ISREG(status.st_mode) ? static_cast<std::size_t>(status.st_size) + 1 : std::size_t{1} << 16);
  for (;;) {
    if (used == bytes.size()) bytes.resize(2 * bytes.size());
    const ssize_t got = ::read(file.fd, bytes.data() + used, bytes.size() - used);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw InputError(name + ": " + reason());
    if (got == 0) break;
    used += static_cast<std::size_t>(got);
    if (used > limit) throw too_large();
  }
  bytes.resize(used);
  return bytes;
}

void write_file(const std::filesystem::path& asked, std::string_view bytes, Flush flush) {
  namespace fs = std::filesystem;
  const std::string name = asked.string();
  std::error_code error;
  // A link stays a link: what it leads to is replaced.
  const bool link = fs::is_symlink(asked, error);
  error.clear();  // what isn't there yet is no link
  const fs::path path = link ? fs::weakly_canonical(asked, error) : asked;
  if (error) throw OutputError(name + ": " + error.message());
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  struct stat there {};
  if (::stat(asked.c_str(), &there) == 0 && !S_ISREG(there.st_mode)) {
    if (S_ISDIR(there.st_mode)) throw OutputError(name + ": it is a directory, must be a file");
    // Devices and pipes take bytes as they come; a rename would put a file in their place.
    Descriptor device{::open(asked.c_str(), O_WRONLY | O_CLOEXEC)};
    if (device.fd < 0 || !write_all(device.fd, bytes)) throw OutputError(name + ": " + reason());
    return;
  }
  fs::create_directories(folder, error);
  if (error) throw OutputError(name + ": the folder can't be made: " + error.message());

  std::string temporary = (folder / ".").string();
  temporary.append(path.filename().string()).append(".XXXXXX");
  // A file without a name until it is whole, so that not even a killed program leaves a part of one; where the file
  // system has no such files, one with a name.
  Descriptor file{nameless_file(folder)};
  const bool nameless = file.fd >= 0;
  if (!nameless) file.fd = ::mkstemp(temporary.data());
  if (file.fd < 0) throw OutputError(name + ": " + reason());
  auto fail = [&]() -> OutputError {
    const std::string why = reason();
    ::unlink(temporary.c_str());
    return OutputError(name + ": " + why);
  };
  if (!write_all(file.fd, bytes)) throw fail();
  // mkstemp gives 0600; a new file gets what the process's mask allows, an old one keeps its mode.
  struct stat old {};
  mode_t mode = 0;
  if (::stat(path.c_str(), &old) == 0) {
    mode = old.st_mode & 07777;
  } else {
    const mode_t mask = ::umask(0);
    ::umask(mask);
    mode = 0666 & ~mask;
  }
  if (::fchmod(file.fd, mode) != 0 || (flush == Flush::yes && ::fsync(file.fd) != 0)) throw fail();
  if (nameless && !give_name(file.fd, temporary)) throw fail();
  const int closed = ::close(file.fd);
  file.fd = -1;
  if (closed != 0 || ::rename(temporary.c_str(), path.c_str()) != 0) throw fail();
}

void require_free(const std::filesystem::path& path, bool overwrite) {
  std::error_code error;
  if (overwrite || !std::filesystem::is_regular_file(path, error)) return;
  throw OutputError(path.string() + " exists; give --overwrite to replace it");
}

}  // namespace toile
