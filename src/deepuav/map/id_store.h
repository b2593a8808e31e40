#pragma once

#include <cassert>
#include <memory>
#include <utility>
#include <vector>

namespace deepuav {

/// Things by id: constant-time access, iteration in order of id. An erased thing leaves one empty
/// pointer. References stay valid until their thing is erased. Thread-compatible.
template <typename IdType, typename T>
class IdStore {
 public:
  bool Contains(IdType id) const {
    return id.valid() && id.value < static_cast<int64_t>(slots_.size()) &&
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
    if (Slot(id) >= slots_.size()) slots_.resize(Slot(id) + 1);
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
    if (slots_.size() < other->slots_.size()) slots_.resize(other->slots_.size());
    for (size_t slot = 0; slot < other->slots_.size(); ++slot) {
      if (!other->slots_[slot]) continue;
      assert(!slots_[slot]);
      slots_[slot] = std::move(other->slots_[slot]);
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
  static size_t Slot(IdType id) { return static_cast<size_t>(id.value); }

  std::vector<std::unique_ptr<T>> slots_;
  int size_ = 0;
};

}  // namespace deepuav
