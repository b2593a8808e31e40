#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <cstdint>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

namespace deepuav {

/// Up to 64 things by place, with their iteration in order of place. Thread-compatible.
template <typename T>
class IdBlock {
 public:
  static constexpr int kBits = 6;
  static constexpr size_t kPlaces = size_t{1} << kBits;

  IdBlock() = default;
  IdBlock(const IdBlock& other) : used_(other.used_) {
    ForEach([&](size_t place) { things_[place] = std::make_unique<T>(*other.things_[place]); });
  }
  IdBlock& operator=(const IdBlock&) = delete;
  ~IdBlock() = default;

  T* Find(size_t place) const { return things_[place].get(); }
  T& Put(size_t place, std::unique_ptr<T> thing) {
    used_ |= uint64_t{1} << place;
    things_[place] = std::move(thing);
    return *things_[place];
  }
  std::unique_ptr<T> Take(size_t place) {
    used_ &= ~(uint64_t{1} << place);
    return std::move(things_[place]);
  }
  bool empty() const { return used_ == 0; }

  /// Calls `visit(place)` for those that are taken, in order; what it visits may go meanwhile.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (uint64_t left = used_; left != 0; left &= left - 1)
      visit(static_cast<size_t>(std::countr_zero(left)));
  }

 private:
  uint64_t used_ = 0;  ///< A bit a place.
  std::array<std::unique_ptr<T>, kPlaces> things_;
};

/// Things by id: constant-time access, iteration in order of id. Room is that of the things, not of
/// the ids between them: blocks without things are given back. References stay valid until their
/// thing is erased. Thread-compatible.
template <typename IdType, typename T>
class IdStore {
 public:
  IdStore() = default;
  IdStore(const IdStore& other) : first_page_(other.first_page_), size_(other.size_) {
    pages_.reserve(other.pages_.size());
    for (const auto& page : other.pages_)
      pages_.push_back(page ? std::make_unique<Page>(*page) : nullptr);
  }
  IdStore& operator=(const IdStore& other) { return *this = IdStore(other); }
  IdStore(IdStore&&) noexcept = default;
  IdStore& operator=(IdStore&&) noexcept = default;
  ~IdStore() = default;

  bool Contains(IdType id) const { return Get(id) != nullptr; }
  T& At(IdType id) {
    assert(Contains(id));
    return *ChunkOf(id)->Find(PlaceInChunk(id));
  }
  const T& At(IdType id) const {
    assert(Contains(id));
    return *ChunkOf(id)->Find(PlaceInChunk(id));
  }
  T* Find(IdType id) { return Get(id); }
  const T* Find(IdType id) const { return Get(id); }

  T& Insert(IdType id, T thing) {
    assert(id.valid() && !Contains(id));
    MakeRoom(PageOf(id), PageOf(id) + 1);
    std::unique_ptr<Page>& page = pages_[static_cast<size_t>(PageOf(id) - first_page_)];
    if (!page) page = std::make_unique<Page>();
    Chunk* chunk = page->Find(PlaceInPage(id));
    if (!chunk) chunk = &page->Put(PlaceInPage(id), std::make_unique<Chunk>());
    ++size_;
    return chunk->Put(PlaceInChunk(id), std::make_unique<T>(std::move(thing)));
  }
  void Erase(IdType id) {
    assert(Contains(id));
    std::unique_ptr<Page>& page = pages_[static_cast<size_t>(PageOf(id) - first_page_)];
    Chunk* chunk = page->Find(PlaceInPage(id));
    chunk->Take(PlaceInChunk(id));
    if (chunk->empty()) page->Take(PlaceInPage(id));
    if (page->empty()) page.reset();
    --size_;
  }

  /// Takes all things of `other`, whose ids must be others than those here.
  void TakeAll(IdStore* other) {
    if (other->pages_.empty()) return;
    MakeRoom(other->first_page_, other->first_page_ + static_cast<int64_t>(other->pages_.size()));
    const auto offset = static_cast<size_t>(other->first_page_ - first_page_);
    for (size_t i = 0; i < other->pages_.size(); ++i)
      TakePage(std::move(other->pages_[i]), &pages_[offset + i]);
    size_ += other->size_;
    *other = IdStore();
  }

  int size() const { return size_; }

  /// Calls `visit(T&)` in order of id. It may erase what it is given, but nothing else.
  template <typename Visit>
  void ForEach(Visit&& visit) {
    ForEachIn(*this, [&visit](T* thing) { visit(*thing); });
  }
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    ForEachIn(*this, [&visit](const T* thing) { visit(*thing); });
  }

 private:
  using Chunk = IdBlock<T>;
  using Page = IdBlock<Chunk>;
  static constexpr int kChunkBits = Chunk::kBits, kPageBits = kChunkBits + Page::kBits;

  static size_t PlaceInChunk(IdType id) {
    return static_cast<size_t>(id.value) & (Chunk::kPlaces - 1);
  }
  static size_t PlaceInPage(IdType id) {
    return static_cast<size_t>(id.value >> kChunkBits) & (Page::kPlaces - 1);
  }
  static int64_t PageOf(IdType id) { return id.value >> kPageBits; }

  /// Of an id that is here.
  Chunk* ChunkOf(IdType id) const {
    return pages_[static_cast<size_t>(PageOf(id) - first_page_)]->Find(PlaceInPage(id));
  }
  T* Get(IdType id) const {
    // Before the first page, too, the index is too large.
    const auto index = static_cast<size_t>(PageOf(id) - first_page_);
    if (index >= pages_.size() || !pages_[index]) return nullptr;
    const Chunk* chunk = pages_[index]->Find(PlaceInPage(id));
    return chunk ? chunk->Find(PlaceInChunk(id)) : nullptr;
  }

  template <typename Store, typename Visit>
  static void ForEachIn(Store& store, const Visit& visit) {
    for (const auto& page : store.pages_) {
      if (!page) continue;
      page->ForEach([&](size_t chunk_place) {
        const Chunk& chunk = *page->Find(chunk_place);
        chunk.ForEach([&](size_t place) { visit(chunk.Find(place)); });
      });
    }
  }

  static void TakePage(std::unique_ptr<Page> from, std::unique_ptr<Page>* into) {
    if (!*into || !from) {
      if (from) *into = std::move(from);
      return;
    }
    from->ForEach([&](size_t chunk_place) {
      Chunk* chunk = (*into)->Find(chunk_place);
      std::unique_ptr<Chunk> taken = from->Take(chunk_place);
      if (!chunk) {
        (*into)->Put(chunk_place, std::move(taken));
        return;
      }
      taken->ForEach([&](size_t place) {
        assert(!chunk->Find(place));
        chunk->Put(place, taken->Take(place));
      });
    });
  }

  /// For the pages from `begin` to before `end`.
  void MakeRoom(int64_t begin, int64_t end) {
    if (pages_.empty()) first_page_ = begin;
    if (begin < first_page_) {
      std::vector<std::unique_ptr<Page>> moved(static_cast<size_t>(first_page_ - begin));
      moved.insert(moved.end(), std::make_move_iterator(pages_.begin()),
                   std::make_move_iterator(pages_.end()));
      pages_ = std::move(moved);
      first_page_ = begin;
    }
    if (end - first_page_ > static_cast<int64_t>(pages_.size()))
      pages_.resize(static_cast<size_t>(end - first_page_));
  }

  std::vector<std::unique_ptr<Page>> pages_;  ///< None where there is nothing.
  int64_t first_page_ = 0;
  int size_ = 0;
};

}  // namespace deepuav
