#include "deepuav/features/stored_descriptors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace deepuav {
namespace {

Descriptors Axes(int first, int count) {
  constexpr int kDimension = 16;
  Descriptors descriptors(kDimension);
  for (int i = 0; i < count; ++i) {
    std::vector<float> row(kDimension, 0.f);
    row[static_cast<size_t>((first + i) % kDimension)] = 1;
    descriptors.Append(row);
  }
  return descriptors;
}

void ExpectEqual(const Descriptors& a, const Descriptors& b) {
  EXPECT_EQ(a.dimension(), b.dimension());
  EXPECT_TRUE(std::ranges::equal(a.stored_values(), b.stored_values()));
  EXPECT_TRUE(std::ranges::equal(a.scales(), b.scales()));
}

TEST(StoredDescriptors, AreAsTheyWere) {
  TemporaryFile file;
  const StoredDescriptors first(Axes(0, 3), &file), second(Axes(5, 4), &file);
  EXPECT_EQ(first.size(), 3);
  EXPECT_EQ(second.size(), 4);
  ExpectEqual(second.Load(), Axes(5, 4));
  ExpectEqual(first.Load(), Axes(0, 3));
  const StoredDescriptors copy = first;
  ExpectEqual(copy.Load(), Axes(0, 3));
}

TEST(StoredDescriptors, WithoutAFileTheyStayInMemory) {
  ExpectEqual(StoredDescriptors(Axes(2, 3), nullptr).Load(), Axes(2, 3));
}

TEST(StoredDescriptors, NoneAreNone) {
  EXPECT_EQ(StoredDescriptors().size(), 0);
  EXPECT_EQ(StoredDescriptors().Load().size(), 0);
  TemporaryFile file;
  EXPECT_EQ(StoredDescriptors(Axes(0, 0), &file).Load().size(), 0);
}

}  // namespace
}  // namespace deepuav
