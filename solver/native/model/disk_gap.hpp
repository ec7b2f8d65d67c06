// The gap between neighbouring disks of a rod.
#pragma once

#include "model/robot.hpp"

namespace ccr {

// Gap where a segment of some length bends by an angle, by the generated law.
DiskGap measure_disk_gap(double angle, double length, double radius, double thickness);

}  // namespace ccr
