#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "deepuav/base/error.h"
#include "deepuav/base/ids.h"

namespace deepuav {

static_assert(std::endian::native == std::endian::little,
              "values are written as they lie in memory, and files are little-endian");

template <typename T>
concept PlainNumber = std::integral<T> || std::floating_point<T>;

/// Collects numbers as little-endian bytes without padding.
class ByteWriter {
 public:
  template <PlainNumber T>
  void Put(std::type_identity_t<T> value) {
    PutAll(std::span<const T>(&value, 1));
  }
  template <PlainNumber T>
  void PutAll(std::span<const T> values) {
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  void Clear() { bytes_.clear(); }  ///< Keeps the memory.

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Reads what a ByteWriter wrote. Refers to the bytes. Every member throws Error, which says where
/// the bytes end, instead of reading past them.
class ByteReader {
 public:
  /// `name` is what the messages call the bytes.
  ByteReader(std::string_view bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}

  template <PlainNumber T>
  T Get() {
    T value;
    GetAll(std::span<T>(&value, 1));
    return value;
  }
  template <PlainNumber T>
  void GetAll(std::span<T> values) {
    Need(values.size_bytes());
    if (values.empty()) return;
    std::memcpy(values.data(), bytes_.data() + position_, values.size_bytes());
    position_ += values.size_bytes();
  }
  /// A number of things to follow, each of at least `bytes_each`: never more than there is room
  /// for, so that memory may be taken for them.
  size_t GetCount(size_t bytes_each) {
    const auto count = Get<uint64_t>();
    if (count > left() / bytes_each) {
      throw Error("{} says at byte {} that {} things follow: expected at most {} in its {} bytes",
                  name_, position_, count, left() / bytes_each, bytes_.size());
    }
    return static_cast<size_t>(count);
  }
  void ExpectEnd() const {
    if (left() > 0) throw Error("{} has {} bytes too many", name_, left());
  }

  size_t left() const { return bytes_.size() - position_; }  ///< Bytes not read yet.

 private:
  void Need(size_t count) const {
    if (count <= left()) return;
    throw Error("{} ends at byte {}: expected at least {} more", name_, bytes_.size(),
                count - left());
  }

  std::string_view bytes_;
  std::string name_;
  size_t position_ = 0;
};

template <typename Tag>
void PutId(Id<Tag> id, ByteWriter* writer) {
  writer->Put<int64_t>(id.value);
}

template <typename IdType>
IdType GetId(ByteReader* reader) {
  return {reader->Get<int64_t>()};
}

}  // namespace deepuav
