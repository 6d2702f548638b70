/* SPDX-License-Identifier: BSD-3-Clause */
/* The tolerances by which ranks, closures, growth and margins are judged, each with its scale and its reason. Scaled: J
 * over its row scales and times its coordinate scales, h over its row scales, coordinates over theirs, so that a number
 * means the same in metres and in millimetres. Lengths of steps and stopping rules of one search stand in its file. */
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
/** A condition of second order is zero: configurations are closed to 1e-13, singular ones to the root of that. A first
 * pivot below the other one says nothing about the order. */
#define KMP_RANK_SECOND 1e-7
#define KMP_RANK_SHAKY  1e-5

/** Articulated bodies are used where they give the accelerations of M and C at the start to this part of their size.
 * They divide by the inertia of each joint with open loops: pivots below the other one have lost too many digits. */
#define KMP_ARTICULATED_AGREE 1e-9
#define KMP_ARTICULATED_PIVOT 1e-8

/** Two closed states that are nearer are one: near a singular position states are closed to the root of rounding. */
#define KMP_SAME_STATE 1e-5

/* -- rounded numbers: pivots of the scaled J, over the first ------------------------------------------- */

/** A pivot below this one may be of rounding: drawings of four digits make pivots of 1e-3. Whether it is, finite
 * motions tell (constraints/rounding/rounding.h). */
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
/** A shift below this one is none. */
#define KMP_MEND_NO_SHIFT 1e-15
/** Shift of a number by which dh/dp is taken, characteristic lengths or rad: dh/dp is off by its square. */
#define KMP_MEND_DIFFERENCE 1e-4
/** Rank of the conditions on the numbers: above the error of dh/dp. Next to change points the conditions are off by OFF
 * times the widest row, so that the rank goes up to MOST_RANK. */
#define KMP_MEND_RANK      1e-8
#define KMP_MEND_OFF       100.0
#define KMP_MEND_MOST_RANK 1e-2
/** A place whose misfit is beyond WIDE times the median lies on another branch; below FOLLOWED of the drawing's misfit
 * it has followed the others. Both were found on lamps, Sarrus linkages and scissors (bench/rounded). */
#define KMP_MEND_WIDE     3.0
#define KMP_MEND_FOLLOWED 0.03
/** A step that leaves more of the misfit is not kept. */
#define KMP_MEND_REDUCED 0.8
/** Redundant rows are met: rounding of one evaluation of h; or, where no step reduces it, that of places with small
 * pivots. */
#define KMP_MEND_MET     3e-16
#define KMP_MEND_STALLED 1e-12
/** Part of the misfit that may remain, or the square of the last digit, where rounding explains it. */
#define KMP_MEND_EXPLAINED 1e-2

/** A finite motion begins here, rad or characteristic lengths: its square is far above any closure tolerance. */
#define KMP_ROUNDING_FAR 0.25
/** Places whose last kept pivot is below this part of that at the start lie beside a change point: they do not count.
 */
#define KMP_ROUNDING_BESIDE 0.3
/** Part of the distant places at which a row must stay within the tolerance, so that rounding is what opens it. */
#define KMP_ROUNDING_MOST_OF 0.7

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
/** Along a run: error weights of a coordinate of the same unit, and times the widest kept row, beyond both of which a
 * dropped row shows that the rank has changed; of rounded numbers, closure tolerances, since the verdict warns of less.
 */
#define KMP_DROPPED_WEIGHTS    1e3
#define KMP_DROPPED_OVER_KEPT  1e2
#define KMP_DROPPED_TOLERANCES 30
/** From here on Newton's method is trusted to stay on the branch that it is on. */
#define KMP_CLOSED_NEAR 1e-4
/** A pivot of J above so many |h| is not zero on the closed mechanism. */
#define KMP_CLOSED_DECIDED 10.0
/** Rates: |J qd + h_t| over the fastest scaled rate that is consistent; of the start's rates, given by hand. */
#define KMP_CLOSED_RATES 1e-9
#define KMP_CLOSED_START 1e-6
/** Rates of a projected step, over the fastest: rounding of J qd, the most that rounding of h may make of it, the
 * margin for the rest of that estimate, and the factor of the estimate from step to step. */
#define KMP_RATE_ROUNDING 1e-9
#define KMP_RATE_NOISE    1e-5
#define KMP_RATE_MARGIN   10.0
#define KMP_RATE_FADES    0.9

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
/** Newton's last correction of a state that a leap starts from: it leaves the square of this. */
#define KMP_CORRECTION_LAST 1e-8

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

/* -- axes of three angles: their determinant, over its largest ----------------------------------------- */

/** Below the first, a joint's angles are centred anew before a run goes on; below the second, assembly centres its
 * angles; below the third, angles that stay fixed are told as singular; below the fourth, derivatives by its
 * angles have lost too many digits. */
#define KMP_AXES_CENTRED 0.4
#define KMP_AXES_TURNED  0.1
#define KMP_AXES_WEAK    0.05
#define KMP_AXES_LOST    0.02
/** Axes are dependent: rounding of their components. The sine below which the first angle is not determined, and the
 * distance (rad) within which it is not followed through its singular position but set beyond it. */
#define KMP_AXES_DEPENDENT 1e-14
#define KMP_AXES_NO_ANGLE  1e-15
#define KMP_AXES_TOUCH     1e-8

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
/** No step of an ordinary formulation ends below this margin when a change point lies there: its stages come nearer
 * still. */
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
/** A margin below EXACT on a branch that is followed is a change point, where branches meet; it is crossed straight on
 * from where the margin was above ENTRY. */
#define KMP_MARGIN_EXACT 1e-6
#define KMP_MARGIN_ENTRY 1e-3
/** A step that became too small is put down to a change point below EXPLAINS. A motion that is followed backwards later
 * ends below ENDS, which only a change point has. */
#define KMP_MARGIN_EXPLAINS 0.02
#define KMP_MARGIN_ENDS     1e-4
/** Rounding of accelerations with the loops open may be this part of rtol, of the accelerations at the start. */
#define KMP_MARGIN_CANCELLED 1e-2
/** Looks for a change point farther ahead go on while each finds so much less of the margin: where the motion comes to
 * rest at one, the margin goes down as the square of time, and the line meets zero half-way. */
#define KMP_MARGIN_AHEAD 0.6
/** The singular vector w: the columns of its iteration are chosen anew where another one holds STALE times more of w;
 * conjugate gradients end at GAP, relative; the vectors of two places are one above the cosine SAME. */
#define KMP_MARGIN_STALE 4.0
#define KMP_MARGIN_GAP   1e-6
#define KMP_MARGIN_SAME  0.5
/** Turn of the free coordinates, rad or characteristic lengths, within which the least singular value shows its usual
 * size; and the turn of all coordinates to other configurations that are looked at. */
#define KMP_MARGIN_NEAR_BY   0.2
#define KMP_MARGIN_ELSEWHERE 0.5

/* -- leaps: polynomials in time across a change point --------------------------------------------------- */

/** Relative size of the last terms at which the polynomial is smooth. Picard's iteration is carried to SETTLED of that,
 * must shrink by SHRINKS, and may end in NOISE times it; beyond ROUGH, or ROUGH times the last change, it is given up.
 */
#define KMP_LEAP_SMOOTH  1e-9
#define KMP_LEAP_SETTLED 1e-2
#define KMP_LEAP_SHRINKS 0.7
#define KMP_LEAP_NOISE   10.0
#define KMP_LEAP_ROUGH   100.0
/** Lengths of leaps that differ by less, of their size, are one; a landing may lie BEYOND times as far as aimed at. */
#define KMP_LEAP_SAME   1e-4
#define KMP_LEAP_BEYOND 1.3
/** What dropped rows need of kept ones, |T|: beyond this they change places, each time making |det Jv| larger by as
 * much, and a step that ends beyond LOST goes too far. */
#define KMP_ROWS_OUT   1.5
#define KMP_ROWS_LOST  30.0
#define KMP_ROWS_SWEEP 3.0
/** Entries below this part of a row of size 1 are rounding: their squares add nothing. */
#define KMP_ROWS_NOTHING 1e-12

#endif
