#include "deepuav/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

TEST(ForEachInParallel, DoesEachOnce) {
  for (const int threads : {0, 1, 3, 50}) {
    std::vector<std::atomic<int>> done(20);
    ForEachInParallel(20, threads, [&](int i) { ++done[static_cast<size_t>(i)]; });
    for (const auto& times : done) EXPECT_EQ(times, 1);
  }
}

TEST(ForEachInParallel, NothingToDo) {
  ForEachInParallel(0, 4, [](int) { FAIL(); });
}

TEST(ForEachInParallel, RethrowsAndBeginsNoMore) {
  for (const int threads : {1, 2}) {
    std::atomic<int> begun = 0;
    EXPECT_THROW(ForEachInParallel(1000, threads,
                                   [&](int) {
                                     ++begun;
                                     throw Error("no more");
                                   }),
                 Error);
    EXPECT_LE(begun, threads);
  }
}

TEST(PartOf, PartsFollowOneAnotherAndMakeTheWhole) {
  for (const int count : {0, 1, 7, 1000}) {
    int next = 0;
    for (int part = 0; part < 8; ++part) {
      const PartOf of(count, part, 8);
      EXPECT_EQ(of.first, next);
      next = of.last;
    }
    EXPECT_EQ(next, count);
  }
}

}  // namespace
}  // namespace deepuav
