/* SPDX-License-Identifier: BSD-3-Clause */
/* The tolerances by which ranks, closures, growth and margins are judged, each with its scale and its reason. Scaled: J
 * over its row scales and times its coordinate scales, h over its row scales, coordinates over theirs, so that a number
 * means the same in metres and in millimetres. */
#ifndef KMP_CONSTRAINTS_TOLERANCES_H
#define KMP_CONSTRAINTS_TOLERANCES_H

/* -- rank of the scaled J: a pivot or singular value over the first ------------------------------------ */

/** At a closed state. Of 430 random mechanisms, redundant lamps, linkages and hard cases, at tens of thousands of
 * states where they are assembled, that random walks close and that runs pass (bench/ranks.c), pivots that count are
 * above 4e-5, the others below 4e-13: of the size of what h is open by. Nearer to the latter, because those that count
 * go down to nothing where a mechanism comes near a change point. */
#define KMP_RANK 1e-10
/** The first pivot itself: of the size of 1, smaller where lengths differ much. One of the size of the root of rounding
 * belongs to closures that hold to second order alone, as a rod does across all that its end can do: no pivot says
 * anything. */
#define KMP_RANK_FIRST 1e-6
/** Rows of a dependent set: their parts in it, over the largest. */
#define KMP_RANK_MEMBER 1e-6
/** Share of a dropped row that another one carries, from which on the multiplier of that one is not determined. */
#define KMP_RANK_SHARED 1e-9
/** A dropped row's part along free directions, from which on it is not redundant: a root of the rounding of J. */
#define KMP_RANK_NOT_REDUNDANT 1e-8
/** Effect of actuators on the reduced equations, over the largest: below it none. */
#define KMP_RANK_ACTUATORS 1e-9
/** A block of the scaled Jv whose least pivot is below this part of its largest has no sign. */
#define KMP_RANK_SIGN 1e-9

/* -- rounded numbers: pivots of the scaled J, over the first ------------------------------------------- */

/** A pivot below this one may be of rounding: drawings of four digits make pivots of 1e-3. Whether it is, finite
 * motions tell (constraints/rounding.h). */
#define KMP_ROUNDING_WEAK 1e-2
/** A pivot below this one is zero, whatever the drawing. */
#define KMP_ROUNDING_NOTHING 1e-12
/** Loops that stay open by more than so many tolerances are not tried. */
#define KMP_ROUNDING_WIDEST 10

/** Largest shift of a number of a rounded drawing, in units of its last digit; of an axis, rad. The nearest exact
 * mechanisms of 1600 lamps and linkages, rounded by half a unit, are within 4.5 units (bench/rounded digits). Axes
 * lost their digits when they were normalised: four digits are assumed. */
#define KMP_MEND_DIGITS 5.0
#define KMP_MEND_AXES   1e-4

/* -- closures: scaled |h|, the largest row ------------------------------------------------------------- */

/** Rounding alone: nothing is gained by a correction. */
#define KMP_CLOSED_ROUNDING 4e-16
/** Rounding: not corrected at the end of a step, and no reason to refuse it, since where levers differ much its
 * correction exceeds fine tolerances. */
#define KMP_CLOSED 4e-15
/** Rounding where corrections no longer shrink; and the same of points far from the origin, in parts of how far, over
 * the characteristic length: h is a difference of such numbers. */
#define KMP_CLOSED_STALLED 2e-14
#define KMP_CLOSED_AFAR    2e-15
/** Closed all the same when rounding stops them: what an assembled mechanism may be open by. */
#define KMP_CLOSED_ENOUGH 1e-11
/** A row that was dropped as redundant, open by more, is not. */
#define KMP_CLOSED_DROPPED 1e-9
/** From here on Newton's method is trusted to stay on the branch that it is on. */
#define KMP_CLOSED_NEAR 1e-4
/** A pivot of J above so many |h| is not zero on the closed mechanism. */
#define KMP_CLOSED_DECIDED 10.0
/** Rates: |J qd + h_t| over the fastest scaled rate that is consistent; of the start's rates, given by hand. */
#define KMP_CLOSED_RATES 1e-9
#define KMP_CLOSED_START 1e-6

/* -- corrections and steps ----------------------------------------------------------------------------- */

/** The longest move of a coordinate by one correction, rad or characteristic lengths. */
#define KMP_LONGEST_CORRECTION 0.5
/** Least bound on a correction from a distant guess: if none longer reduces |h| as predicted, the state is
 * stationary. */
#define KMP_SHORTEST_CORRECTION 1e-8
/** Least damping, scaled, of least changes; otherwise |h| damps. Its square exceeds the square of a singular value
 * that rounding leaves in J J' where rows are redundant. */
#define KMP_LEAST_DAMPING 1e-6
/** A closure correction beyond this many error weights refuses a step. */
#define KMP_CORRECTION_LIMIT 1.0
/** The same of v carried along where rows are dropped: with each choice of rows the motion off the closures is another
 * one, and the error estimate of a step sees less of it. With 1 errors are 4 to 8 times as large, with 1e-2 twice. */
#define KMP_CORRECTION_REDUNDANT 3e-3
/** Scaled corrections below this are held against KMP_CORRECTION_LIMIT alone: rounding of h makes some of them. */
#define KMP_CORRECTION_ROUNDING 1e-13
/** Newton in an evaluation stops at this fraction of the error weights. */
#define KMP_CORRECTION_IN_STAGE 1e-2

/* -- growth: scaled |Bvu| ------------------------------------------------------------------------------ */

/** Exchanges go on as long as they make |det Jv| larger by this: 1 would never end on ties. */
#define KMP_PICK_GROWTH 1.5
/** Beyond this, u and v are exchanged: of Kempe's own choice and of a user's wish. Closed, the right-hand side is a
 * function of u alone, whose series end at u's dead centre: most of its error is made on the way there; an integrator
 * that begins anew at each exchange pays more for it than it gains. */
#define KMP_EXCHANGE_GROWTH 1.5
#define KMP_EXCHANGE_CLOSED 1.1
#define KMP_EXCHANGE_WISH   10.0
/** Where nothing is integrated, a choice serves as far as its digits: equilibria are found by few steps, so that a good
 * choice costs little; sweeps and led motions take many. */
#define KMP_EXCHANGE_STILL 2.0
#define KMP_EXCHANGE_SWEEP 3.0
#define KMP_EXCHANGE_LED   4.0
/** A wish is refused when its |Bvu| would exceed this at the start. */
#define KMP_GROWTH_WISH 1e4
/** Beyond this a fixed u is given up: errors of u reach v multiplied by it. */
#define KMP_GROWTH_LIMIT 1e3
/** How far v goes, scaled, for rows that open by their scale: beyond, the last pivot of Jv may be none, and the rank is
 * decided anew. */
#define KMP_GROWTH_LEVER 1e6
/** From here on a step that became too small is put down to the choice of u. */
#define KMP_GROWTH_EXPLAINS 20.0

/* -- margins: the least singular value of the independent rows of the scaled J, over its usual size --- */

/** The margin below which a run leaps over a change point that lies straight ahead; the one at which a leap that has
 * landed hands over to the formulation again; and the one above which the surroundings of a place that no leap could
 * pass are left. The next step of an ensemble's lane may be longer than the last one by KMP_GROWING. */
#define KMP_ZONE_IN   0.15
#define KMP_ZONE_OUT  0.03
#define KMP_ZONE_LEFT 0.2
#define KMP_GROWING   1.5
/** What is left of the margin where the line ahead comes nearest to zero, below which it leads to a change point; and
 * the same as a part of what the margin is now, so that small margins alone are no alarm. Mechanisms that only pass by
 * at one or some hundredths are resolved by steps as they are. */
#define KMP_MARGIN_AIM   1e-2
#define KMP_MARGIN_STEEP 0.3
/** If J at the predicted place has at most this part of the present margin, the place is a change point. */
#define KMP_MARGIN_THERE 2e-2
/** No step of an ordinary road ends below this margin when a change point lies there: its stages come nearer still. */
#define KMP_MARGIN_DEEP 0.1
/** If no step across was found because the motion turns, the next one is tried at this part of the margin. */
#define KMP_MARGIN_AGAIN 0.1
/** Least pivots above this part of their usual size call for nothing more. */
#define KMP_MARGIN_CALLS 0.4
/** A step has passed a singular place when w has turned so far (cosine), past zero by less than this. */
#define KMP_MARGIN_TURNED -0.5
#define KMP_MARGIN_PASSED 0.3
/** A last pivot of the start below this part of the first is looked at; it is near a change point when its margin is
 * below this part of that at configurations turned by a little along the closures. */
#define KMP_MARGIN_LOOK 1e-2
#define KMP_MARGIN_NEAR 0.04
/** A margin below LOCKED, which leaving out one row lifts above FREED, is that row's doing. */
#define KMP_MARGIN_LOCKED 0.1
#define KMP_MARGIN_FREED  0.2
/** What dropped rows need of kept ones, |T|: beyond this they change places, each time making |det Jv| larger by as
 * much, and a step that ends beyond LOST goes too far. */
#define KMP_ROWS_OUT   1.5
#define KMP_ROWS_LOST  30.0
#define KMP_ROWS_SWEEP 3.0
/** Entries below this part of a row of size 1 are rounding: their squares add nothing. */
#define KMP_ROWS_NOTHING 1e-12

#endif
