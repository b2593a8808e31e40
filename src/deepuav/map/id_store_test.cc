#include "deepuav/map/id_store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "deepuav/base/ids.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using Store = IdStore<LandmarkId, int>;

std::vector<int> Values(const Store& store) {
  std::vector<int> values;
  store.ForEach([&values](const int& value) { values.push_back(value); });
  return values;
}

TEST(IdStore, IteratesInOrderOfIdWhateverTheOrderOfInsertion) {
  Store store;
  store.Insert({7}, 70);
  store.Insert({0}, 0);
  store.Insert({3}, 30);
  EXPECT_EQ(Values(store), (std::vector<int>{0, 30, 70}));
  EXPECT_EQ(store.size(), 3);
  store.Erase({3});
  EXPECT_EQ(Values(store), (std::vector<int>{0, 70}));
  EXPECT_EQ(store.size(), 2);
}

TEST(IdStore, KnowsWhatItContains) {
  Store store;
  EXPECT_FALSE(store.Contains({}));
  EXPECT_FALSE(store.Contains({0}));
  EXPECT_EQ(store.Find({0}), nullptr);
  store.Insert({2}, 20);
  EXPECT_TRUE(store.Contains({2}));
  EXPECT_FALSE(store.Contains({1}));
  EXPECT_FALSE(store.Contains({3}));
  EXPECT_EQ(*store.Find({2}), 20);
  EXPECT_EQ(std::as_const(store).At({2}), 20);
  store.Erase({2});
  EXPECT_FALSE(store.Contains({2}));
  EXPECT_EQ(store.Find({2}), nullptr);
}

TEST(IdStore, ReferencesStayValidWhileOthersComeAndGo) {
  Store store;
  int& kept = store.Insert({5}, 50);
  for (int i = 6; i < 5000; ++i) store.Insert({i}, i);
  for (int i = 6; i < 5000; i += 2) store.Erase({i});
  kept = 51;
  EXPECT_EQ(store.At({5}), 51);
  store.ForEach([](int& value) { ++value; });
  EXPECT_EQ(kept, 52);
}

TEST(IdStore, RoomIsThatOfItsOwnIds) {
  constexpr int64_t kFar = int64_t{1} << 40;
  Store store;
  store.Insert({kFar}, 1);
  store.Insert({kFar - 3}, 2);
  store.Insert({kFar + 2}, 3);
  EXPECT_EQ(Values(store), (std::vector<int>{2, 1, 3}));
  EXPECT_FALSE(store.Contains({kFar - 4}));
  EXPECT_FALSE(store.Contains({kFar - 1}));
  EXPECT_FALSE(store.Contains({0}));
  EXPECT_FALSE(store.Contains({kFar + 3}));
}

TEST(IdStore, TakesAllOfAnotherWithLesserOrGreaterIds) {
  for (int64_t first : {10, 25, 40}) {
    Store store, other;
    for (int64_t i : {20, 30}) store.Insert({i}, static_cast<int>(i));
    for (int64_t i : {first, first + 4}) other.Insert({i}, static_cast<int>(i));
    store.TakeAll(&other);
    std::vector<int> expected = {20, 30, static_cast<int>(first), static_cast<int>(first) + 4};
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(Values(store), expected);
    EXPECT_EQ(store.size(), 4);
    EXPECT_EQ(other.size(), 0);
    store.TakeAll(&other);
    EXPECT_EQ(store.size(), 4);
  }
}

TEST(IdStore, TakesAllOfAnotherWhichIsEmptyThen) {
  for (const bool into_longer : {true, false}) {
    Store a, b;
    for (int i : {1, 4}) a.Insert({i}, 10 * i);
    for (int i : {0, 2, 7}) b.Insert({i}, 10 * i);
    const int& kept = b.At({7});
    Store& into = into_longer ? b : a;
    Store& from = into_longer ? a : b;
    into.TakeAll(&from);
    EXPECT_EQ(into.size(), 5);
    EXPECT_EQ(Values(into), (std::vector<int>{0, 10, 20, 40, 70}));
    EXPECT_EQ(&into.At({7}), &kept) << "references stay valid";
    EXPECT_EQ(from.size(), 0);
    EXPECT_TRUE(Values(from).empty());
    EXPECT_FALSE(from.Contains({1}));
    from.Insert({1}, 5);
    EXPECT_EQ(from.At({1}), 5);
  }
}

TEST(IdStore, BehavesLikeAStandardMap) {
  Random random(1);
  Store store;
  std::map<int64_t, int> model;
  for (int i = 0; i < 5000; ++i) {
    const int64_t id = random.Index(300);
    ASSERT_EQ(store.Contains({id}), model.contains(id));
    if (model.contains(id)) {
      store.Erase({id});
      model.erase(id);
    } else {
      store.Insert({id}, i);
      model[id] = i;
    }
    ASSERT_EQ(store.size(), static_cast<int>(model.size()));
  }
  std::vector<int> expected;
  for (const auto& entry : model) expected.push_back(entry.second);
  EXPECT_EQ(Values(store), expected);
}

/// Counts what is there of it.
struct Counted {
  explicit Counted(int* counter) : count(counter) { ++*count; }
  Counted(const Counted& other) : count(other.count) { ++*count; }
  Counted& operator=(const Counted&) = delete;
  ~Counted() { --*count; }
  int* count;
};

TEST(IdStore, WhatIsErasedIsGoneAndItsBlockCanBeFilledAgain) {
  int count = 0;
  IdStore<LandmarkId, Counted> store;
  for (int64_t round = 0; round < 3; ++round) {
    for (int64_t id = 100; id < 20'000; id += 7) store.Insert({id}, Counted(&count));
    EXPECT_EQ(count, store.size());
    for (int64_t id = 100; id < 20'000; id += 7) store.Erase({id});
    EXPECT_EQ(count, 0);
    EXPECT_EQ(store.size(), 0);
    store.ForEach([](const Counted&) { ADD_FAILURE() << "nothing is there"; });
    EXPECT_FALSE(store.Contains({100}));
    EXPECT_EQ(store.Find({19'000}), nullptr);
  }
  store.Insert({5000}, Counted(&count));
  store.Insert({3}, Counted(&count));
  EXPECT_EQ(count, 2);
}

TEST(IdStore, LesserIdsThanTheFirstBlocksCanComeLater) {
  Store store;
  store.Insert({100'000}, 1);
  store.Erase({100'000});
  for (int64_t id : {70'000, 69'999, 64, 63, 0}) store.Insert({id}, static_cast<int>(id));
  EXPECT_EQ(Values(store), (std::vector<int>{0, 63, 64, 69'999, 70'000}));
  EXPECT_FALSE(store.Contains({100'000}));
  EXPECT_FALSE(store.Contains({1}));
  EXPECT_FALSE(store.Contains({65}));
}

TEST(IdStore, ACopyIsOfItsOwn) {
  Store store;
  for (int64_t id : {2, 66, 5000, 90'000}) store.Insert({id}, static_cast<int>(id));
  store.Erase({66});
  Store copy = store;
  EXPECT_EQ(Values(copy), (std::vector<int>{2, 5000, 90'000}));
  EXPECT_EQ(copy.size(), 3);
  EXPECT_NE(&copy.At({2}), &store.At({2}));
  copy.At({2}) = 3;
  copy.Erase({5000});
  copy.Insert({66}, 67);
  EXPECT_EQ(Values(store), (std::vector<int>{2, 5000, 90'000}));
  store = copy;
  EXPECT_EQ(Values(store), (std::vector<int>{3, 67, 90'000}));
}

TEST(IdStore, WhatIsVisitedMayBeErasedMeanwhile) {
  Store store;
  std::vector<int> ids;
  for (int id = 0; id < 10'000; id += 37) ids.push_back(id);
  for (int id : ids) store.Insert({id}, id);
  std::vector<int> visited;
  store.ForEach([&](int& value) {
    visited.push_back(value);
    store.Erase({value});
  });
  EXPECT_EQ(visited, ids);
  EXPECT_EQ(store.size(), 0);
}

TEST(IdStore, TakesBlocksThatBothHaveAndBlocksOfOneOnly) {
  for (const bool into_first : {true, false}) {
    Store first, second;
    for (int64_t id : {0, 64, 130, 5000}) first.Insert({id}, static_cast<int>(id));
    for (int64_t id : {1, 65, 200, 4096, 50'000}) second.Insert({id}, static_cast<int>(id));
    const int& kept = first.At({130});
    const int& other_kept = second.At({65});
    Store& into = into_first ? first : second;
    Store& from = into_first ? second : first;
    into.TakeAll(&from);
    EXPECT_EQ(Values(into), (std::vector<int>{0, 1, 64, 65, 130, 200, 4096, 5000, 50'000}));
    EXPECT_EQ(into.size(), 9);
    EXPECT_EQ(&into.At({130}), &kept);
    EXPECT_EQ(&into.At({65}), &other_kept);
    EXPECT_TRUE(Values(from).empty());
    into.Erase({4096});
    into.Erase({5000});
    EXPECT_EQ(Values(into), (std::vector<int>{0, 1, 64, 65, 130, 200, 50'000}));
  }
}

TEST(IdStore, BehavesLikeAStandardMapWhileIdsGrow) {
  Random random(2);
  Store store;
  std::map<int64_t, int> model;
  for (int64_t next = 0; next < 30'000; ++next) {
    store.Insert({next}, static_cast<int>(next));
    model[next] = static_cast<int>(next);
    if (model.size() < 100) continue;
    // Mostly new ones go, as landmarks do.
    const int64_t id = random.Index(10) > 0 ? next - random.Index(60) : model.begin()->first;
    if (store.Contains({id})) store.Erase({id});
    model.erase(id);
  }
  std::vector<int> expected;
  for (const auto& entry : model) expected.push_back(entry.second);
  EXPECT_EQ(Values(store), expected);
  for (int64_t id = 0; id < 30'000; ++id) ASSERT_EQ(store.Contains({id}), model.contains(id)) << id;
}

}  // namespace
}  // namespace deepuav
