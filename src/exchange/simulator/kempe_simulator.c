/* SPDX-License-Identifier: BSD-3-Clause */
/* The simulator of kempe_simulator.h. An ordinary differential equation for y = (u, ud, v): independent coordinates,
 * their rates, dependent coordinates. Within a step v is integrated by its rate, which is exact; at the end of each
 * step, and for each output, Newton's method closes the loops, and only u and ud count. A correction beyond the error
 * weights rejects the step.
 *
 * A step is a function only of the state at its beginning. Outputs within it are its dense output with loops closed.
 * Changes at the end of a step, of modes or of the choice of coordinates, are made at the beginning of the next one. So
 * the coordinates and modes of a step are also the ones of its dense output.
 *
 * simulator_along.h is the last part; each part includes the one before it. */
#include "kempe_simulator.h"
#include "exchange/simulator/simulator_along.h"
