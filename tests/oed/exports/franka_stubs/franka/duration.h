// Stub of libfranka's header.
#pragma once
#include <cstdint>
namespace franka {
class Duration {
 public:
  Duration() noexcept = default;
  explicit Duration(uint64_t milliseconds) noexcept : duration_(milliseconds) {}
  double toSec() const noexcept { return static_cast<double>(duration_) / 1000.0; }
  uint64_t toMSec() const noexcept { return duration_; }

 private:
  uint64_t duration_ = 0;
};
}  // namespace franka
