#pragma once

#include <cassert>
#include <cstdint>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

namespace deepuav {

/// Things by id: constant-time access, iteration in order of id. An erased thing, or an id given
/// elsewhere between the least and the largest here, takes one empty pointer. References stay valid
/// until their thing is erased. Thread-compatible.
template <typename IdType, typename T>
class IdStore {
 public:
  IdStore() = default;
  IdStore(const IdStore& other) : first_(other.first_), size_(other.size_) {
    slots_.reserve(other.slots_.size());
    for (const auto& slot : other.slots_)
      slots_.push_back(slot ? std::make_unique<T>(*slot) : nullptr);
  }
  IdStore& operator=(const IdStore& other) { return *this = IdStore(other); }
  IdStore(IdStore&&) noexcept = default;
  IdStore& operator=(IdStore&&) noexcept = default;
  ~IdStore() = default;

  bool Contains(IdType id) const {
    return id.value >= first_ && id.value - first_ < static_cast<int64_t>(slots_.size()) &&
           slots_[Slot(id)] != nullptr;
  }
  T& At(IdType id) {
    assert(Contains(id));
    return *slots_[Slot(id)];
  }
  const T& At(IdType id) const {
    assert(Contains(id));
    return *slots_[Slot(id)];
  }
  T* Find(IdType id) { return Contains(id) ? slots_[Slot(id)].get() : nullptr; }
  const T* Find(IdType id) const { return Contains(id) ? slots_[Slot(id)].get() : nullptr; }

  T& Insert(IdType id, T thing) {
    assert(id.valid() && !Contains(id));
    MakeRoom(id.value, id.value + 1);
    slots_[Slot(id)] = std::make_unique<T>(std::move(thing));
    ++size_;
    return *slots_[Slot(id)];
  }
  void Erase(IdType id) {
    assert(Contains(id));
    slots_[Slot(id)].reset();
    --size_;
  }

  /// Takes all things of `other`, whose ids must be others than those here.
  void TakeAll(IdStore* other) {
    if (other->slots_.empty()) return;
    MakeRoom(other->first_, other->first_ + static_cast<int64_t>(other->slots_.size()));
    const auto offset = static_cast<size_t>(other->first_ - first_);
    for (size_t slot = 0; slot < other->slots_.size(); ++slot) {
      if (!other->slots_[slot]) continue;
      assert(!slots_[offset + slot]);
      slots_[offset + slot] = std::move(other->slots_[slot]);
    }
    size_ += other->size_;
    *other = IdStore();
  }

  int size() const { return size_; }

  /// Calls `visit(T&)` in order of id.
  template <typename Visit>
  void ForEach(Visit&& visit) {
    for (auto& slot : slots_) {
      if (slot) visit(*slot);
    }
  }
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (const auto& slot : slots_) {
      if (slot) visit(std::as_const(*slot));
    }
  }

 private:
  size_t Slot(IdType id) const { return static_cast<size_t>(id.value - first_); }

  /// For the ids from `begin` to before `end`.
  void MakeRoom(int64_t begin, int64_t end) {
    if (slots_.empty()) first_ = begin;
    if (begin < first_) {
      std::vector<std::unique_ptr<T>> moved(static_cast<size_t>(first_ - begin));
      moved.insert(moved.end(), std::make_move_iterator(slots_.begin()),
                   std::make_move_iterator(slots_.end()));
      slots_ = std::move(moved);
      first_ = begin;
    }
    if (end - first_ > static_cast<int64_t>(slots_.size()))
      slots_.resize(static_cast<size_t>(end - first_));
  }

  std::vector<std::unique_ptr<T>> slots_;
  int64_t first_ = 0;  ///< The id of the first slot.
  int size_ = 0;
};

}  // namespace deepuav
