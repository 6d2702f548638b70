/* SPDX-License-Identifier: BSD-3-Clause */
/* Profiles in text files of measuring instruments and of other programs: MiniProf (.ban of rails, .whl of wheels) and
 * Simpack (.prr, .prw). */
#pragma once

#include "model/read/reading.h"

/** Reads the points of the file that `node` names, y outwards and z upwards in m, y ascending. Points are left out
 * that the other surface cannot reach along z: seen from above of a rail, from below of a wheel. False after an
 * error. */
bool kmp_read_profile_file(kmp_points *p, const kmp_yaml *node);
