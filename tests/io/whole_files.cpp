// SPDX-License-Identifier: GPL-3.0-or-later
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "geometry/error.h"
#include "io/file.h"
#include "io/iges.h"

namespace toile {
namespace {

class WholeFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::temp_directory_path() /
             ("toile_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + "_" +
              std::to_string(::getpid()));
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }
  std::filesystem::path folder;
};

TEST_F(WholeFile, ComesBackWithEveryByte) {
  std::string bytes;
  for (int i = 0; i < 300000; ++i) bytes += static_cast<char>(i * 7 % 256);
  write_file(folder / "new" / "deep" / "a.bin", bytes);
  EXPECT_EQ(read_file(folder / "new" / "deep" / "a.bin"), bytes);
}

TEST_F(WholeFile, ReplacesItsPredecessorAndLeavesNothingBeside) {
  write_file(folder / "a", "one");
  write_file(folder / "a", "two");
  EXPECT_EQ(read_file(folder / "a"), "two");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
}

TEST_F(WholeFile, ReadingRefusesDirectoriesMissingAndOversizedFiles) {
  EXPECT_THROW(read_file(folder), InputError);
  EXPECT_THROW(read_file(folder / "missing"), InputError);
  EXPECT_THROW(read_iges(folder), InputError);
  EXPECT_THROW(read_iges(folder / "missing.igs"), InputError);
  write_file(folder / "big", std::string(100, 'x'));
  EXPECT_THROW(read_file(folder / "big", 99), InputError);
  EXPECT_EQ(read_file(folder / "big", 100).size(), 100u);
}

TEST_F(WholeFile, ALinkStaysALink) {
  write_file(folder / "target", "old");
  std::filesystem::create_symlink("target", folder / "link");
  write_file(folder / "link", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(read_file(folder / "target"), "new");
}

TEST_F(WholeFile, ADeviceOrPipeIsWrittenToNotReplaced) {
  const std::filesystem::path pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  write_file(pipe, "through");
  char got[16] = {};
  EXPECT_EQ(::read(reader, got, sizeof got), 7);
  ::close(reader);
  EXPECT_STREQ(got, "through");
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));

  // Through a link, so that a program that replaces what it is given harms no device of this machine.
  std::filesystem::create_symlink("/dev/full", folder / "full");
  if (!std::filesystem::is_character_file("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_THROW(write_file(folder / "full", "new"), OutputError);
}

TEST_F(WholeFile, AFailedWriteKeepsWhatStoodThere) {
  write_file(folder / "a", "old");
  EXPECT_THROW(write_file(folder / "a" / "b", "new"), OutputError);  // a parent that is a file
  EXPECT_THROW(write_file(folder, "new"), OutputError);              // a place that is a folder
  EXPECT_EQ(read_file(folder / "a"), "old");
}

}  // namespace
}  // namespace toile
