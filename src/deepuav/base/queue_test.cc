#include "deepuav/base/queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace deepuav {
namespace {

TEST(BoundedQueue, IsFirstInFirstOut) {
  BoundedQueue<int> queue(3);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(queue.Push(i));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(queue.Pop(), i);
}

TEST(BoundedQueue, TakesItemsThatOnlyMove) {
  BoundedQueue<std::unique_ptr<int>> queue(1);
  EXPECT_TRUE(queue.Push(std::make_unique<int>(5)));
  EXPECT_EQ(**queue.Pop(), 5);
}

TEST(BoundedQueue, GivesWhatIsInsideAfterClosing) {
  BoundedQueue<int> queue(2);
  queue.Push(1);
  queue.Close();
  EXPECT_FALSE(queue.Push(2));
  EXPECT_EQ(queue.Pop(), 1);
  EXPECT_EQ(queue.Pop(), std::nullopt);
  EXPECT_EQ(queue.Pop(), std::nullopt);
}

TEST(BoundedQueue, NeverHoldsMoreThanItsCapacity) {
  constexpr int kItems = 5000, kCapacity = 3;
  BoundedQueue<int> queue(kCapacity);
  std::atomic<int> pushed = 0;
  std::thread producer([&] {
    for (int i = 0; i < kItems; ++i) {
      queue.Push(i);
      ++pushed;
    }
    queue.Close();
  });
  int popped = 0, most_inside = 0;
  while (true) {
    most_inside = std::max(most_inside, pushed - popped);
    const std::optional<int> item = queue.Pop();
    if (!item) break;
    EXPECT_EQ(*item, popped);
    ++popped;
  }
  producer.join();
  EXPECT_EQ(popped, kItems);
  EXPECT_LE(most_inside, kCapacity);
}

TEST(BoundedQueue, DeliversEachItemOnceBetweenManyThreads) {
  constexpr int kProducers = 4, kConsumers = 3, kItemsEach = 3000;
  BoundedQueue<int> queue(8);
  std::vector<std::thread> producers, consumers;
  std::vector<std::vector<int>> received(kConsumers);
  for (int c = 0; c < kConsumers; ++c) {
    consumers.emplace_back([&, c] {
      while (const std::optional<int> item = queue.Pop()) received[c].push_back(*item);
    });
  }
  for (int p = 0; p < kProducers; ++p) {
    producers.emplace_back([&, p] {
      for (int i = 0; i < kItemsEach; ++i) EXPECT_TRUE(queue.Push(p * kItemsEach + i));
    });
  }
  for (std::thread& producer : producers) producer.join();
  queue.Close();
  for (std::thread& consumer : consumers) consumer.join();

  std::vector<int> all;
  for (const std::vector<int>& items : received) {
    std::vector<int> last(kProducers, -1);
    for (const int item : items) {
      EXPECT_GT(item, last[item / kItemsEach]) << "one producer's items came out of order";
      last[item / kItemsEach] = item;
      all.push_back(item);
    }
  }
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), static_cast<size_t>(kProducers * kItemsEach));
  for (int i = 0; i < kProducers * kItemsEach; ++i) ASSERT_EQ(all[i], i);
}

TEST(BoundedQueue, ClosingWakesAllThatWait) {
  BoundedQueue<int> full(1), empty(1);
  full.Push(0);
  std::atomic<int> refused = 0, ended = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] { refused += !full.Push(1); });
    threads.emplace_back([&] { ended += !empty.Pop(); });
  }
  full.Close();
  empty.Close();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(refused, 3);
  EXPECT_EQ(ended, 3);
}

}  // namespace
}  // namespace deepuav
