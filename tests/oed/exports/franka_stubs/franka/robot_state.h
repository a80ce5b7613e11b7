// Stub of libfranka's header: the fields that the player uses, with the same types.
#pragma once
#include <array>
#include <franka/duration.h>
namespace franka {
struct RobotState {
  std::array<double, 7> q{}, q_d{}, dq{}, tau_J{};
  Duration time{};
};
}  // namespace franka
