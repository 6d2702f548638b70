/* SPDX-License-Identifier: BSD-3-Clause */
/* What is asked of the end of a step: of one run and of each lane of an ensemble alike. */
#ifndef KMP_INTEGRATORS_WATCHED_H
#define KMP_INTEGRATORS_WATCHED_H

/** Scaled |Bvu| beyond which u and v are exchanged, of Kempe's own choice and of a user's wish. Closed, the right-hand
 * side is a function of u alone, whose series end at u's dead centre: most of its error is made on the way there; an
 * integrator that begins anew at each exchange pays more for it than it gains. */
#define KMP_EXCHANGE_GROWTH 1.5
#define KMP_EXCHANGE_CLOSED 1.1
#define KMP_EXCHANGE_WISH   10.0

/** A closure correction beyond this many error weights refuses a step. */
#define KMP_CORRECTION_LIMIT 1.0

/** Scaled h below this is rounding: not corrected, and no reason to refuse a step, since where levers differ much its
 * correction exceeds fine tolerances. */
#define KMP_CLOSED 4e-15

/** The margin, of the start's, at which a run enters the zone about a change point; a next step may be longer than the
 * last one by KMP_GROWING. */
#define KMP_ZONE_IN 0.15
#define KMP_GROWING 1.5

#endif
