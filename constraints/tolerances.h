/* SPDX-License-Identifier: BSD-3-Clause */
/* Tolerances of ranks, closures, growth and margins, each with its scale and its reason. Scaled quantities mean the
 * same in metres and in millimetres: J over its row scales and times its coordinate scales, h over its row scales,
 * coordinates over theirs. Step lengths and stopping rules of a single search are in the file of that search. */
#pragma once

/* -- rank of the scaled J: a pivot or singular value over the first ------------------------------------ */

/** At a closed state. bench/bench_ranks.c measured 430 random mechanisms, redundant lamps, linkages and hard cases at
 * tens of thousands of states, assembled, on random walks and in runs. Pivots that count are above 4e-5, the others
 * below 4e-13, the size of the remaining |h|. The value is nearer to the latter, because pivots that count approach
 * zero near a change point. */
#define KMP_RANK 1e-10
/** The first pivot itself: of size 1, smaller if lengths differ much. A first pivot of the size of the root of rounding
 * belongs to closures that hold only to second order, as of a rod across its end: pivots give no rank. */
#define KMP_RANK_FIRST 1e-6
/** A row with a column that no other row has is independent of them where its entry there is at least this part of its
 * largest one; so is a sequence of such rows by the product of these parts. It is far above the least pivot of a row
 * that counts, KMP_FRICTION_RANK. */
#define KMP_ROW_OWN 1e-2
/** Rows of a dependent set: their components in it, over the largest. */
#define KMP_RANK_MEMBER 1e-6
/** Least share of another row in a dropped row with which that other row's multiplier is not determined. */
#define KMP_RANK_SHARED 1e-9
/** Least component of a dropped row along free directions with which it is not redundant: root of rounding of J. */
#define KMP_RANK_NOT_REDUNDANT 1e-8
/** Effect of actuators on the reduced equations, over the largest: smaller ones have none. */
#define KMP_RANK_ACTUATORS 1e-9
/** Generalized forces that actuators leave, over the largest required one: smaller ones are rounding. */
#define KMP_EFFORTS_LEFT 1e-9
/** A block of the scaled Jv whose least pivot is below this part of its largest has no sign. */
#define KMP_RANK_SIGN 1e-9
/** A condition of second order is zero: configurations are closed to 1e-13, singular ones to the root of 1e-13. A first
 * pivot below SHAKY gives no information about the order. */
#define KMP_RANK_SECOND 1e-7
#define KMP_RANK_SHAKY  1e-5

/** Articulated bodies are used if their accelerations at the start agree with the accelerations by M and C to this
 * relative accuracy. They divide by the inertia of each joint with open loops. */
#define KMP_ARTICULATED_AGREE 1e-9
/** Both may differ by more where the system is badly conditioned, as on a long chain. Articulated bodies are used, too,
 * if their backward error is rounding: it is below 1e-16 on chains of 1000 links, and 7e-5 where a joint moves almost
 * no inertia. */
#define KMP_ARTICULATED_BACKWARD 1e-12
/** Accelerations at rest, 1/s^2 in the scales of coordinates, beyond which a joint may move no mass but rounding: then
 * M decides. */
#define KMP_ARTICULATED_DOUBTFUL 1e8

/** The least pivot of M at the end of a run over the pivot without the deflection of a flexible body, below which the
 * deflection is named as the cause of the end. M changes its sign soon after. */
#define KMP_INERTIA_LOST 0.3
/** The least pivot of M at the end of a run below which some motion moves hardly any mass: deflections of a thousandth
 * of a length give a thin beam such a part of its inertia. */
#define KMP_INERTIA_LEFT 1e-6

/** Pivots of M and J M^-1 J' over the diagonal before elimination: a smaller one has lost five digits or more, and the
 * saddle system is solved with pivots chosen by their size (constraints/programs/saddle_program.h). */
#define KMP_SADDLE_PROGRAM_PIVOT 1e-5

/** Multipliers of two solutions of load-dependent forces differ by more than this part of the largest: each is known to
 * some thousand roundings. */
#define KMP_OTHER_LOAD 1e-8

/** Relative residual of multipliers that forces depend on that is rounding, and one that is rounding if Newton's method
 * no longer reduces it: for a slider-crank with Jv at a thousandth of its usual size it stops at 14 epsilon. */
#define KMP_LOAD_ROUNDING (8 * DBL_EPSILON)
#define KMP_LOAD_ROUNDED  (4096 * DBL_EPSILON)

/** Closed states at a smaller distance are equal: near a singular position states are closed to the root of
 * rounding. */
#define KMP_SAME_STATE 1e-5

/* Times the distance of two neighbouring states of a sweep: a state between their values that is farther from both is
 * on another branch. A smooth branch stays within once that distance; a fold is steeper. */
#define KMP_OTHER_BRANCH 10

/* -- rounded numbers: pivots of the scaled J, over the first ------------------------------------------- */

/** A smaller pivot may be due to rounding: drawings of four digits make pivots of 1e-3. Finite motions decide
 * (constraints/closing/rounding.h). */
#define KMP_ROUNDING_WEAK 1e-2
/** A smaller pivot is zero for any drawing. */
#define KMP_ROUNDING_NOTHING 1e-12
/** Loops that stay open by more than this many tolerances are not tried. */
#define KMP_ROUNDING_WIDEST 10

/** Largest shift of a number of a rounded drawing, in units of its last digit; of an axis, rad. For 1600 lamps and
 * linkages, rounded by half a unit, the nearest exact mechanisms are within 4.5 units (bench/rounded digits). Axes lost
 * their digits when they were normalised: four digits are assumed. */
#define KMP_MEND_DIGITS 5.0
#define KMP_MEND_AXES   1e-4
/** A smaller shift is zero. */
#define KMP_MEND_NO_SHIFT 1e-15
/** Shift in the difference quotient dh/dp, characteristic lengths or rad: the error of dh/dp is its square. */
#define KMP_MEND_DIFFERENCE 1e-4
/** Rank of the conditions on the numbers: above the error of dh/dp. Near change points the error of the conditions is
 * OFF times the widest row, so that the rank tolerance grows up to MOST_RANK. */
#define KMP_MEND_RANK      1e-8
#define KMP_MEND_OFF       100.0
#define KMP_MEND_MOST_RANK 1e-2
/** A place with a misfit beyond WIDE times the median lies on another branch. A place below FOLLOWED of the drawing's
 * misfit has followed the others. Both were found on lamps, Sarrus linkages and scissors (bench/rounded). */
#define KMP_MEND_WIDE     3.0
#define KMP_MEND_FOLLOWED 0.03
/** A step that leaves a larger part of the misfit is rejected. */
#define KMP_MEND_REDUCED 0.8
/** Redundant rows are met to rounding of one evaluation of h; or, if no step reduces the misfit, to the misfit of
 * places with small pivots. */
#define KMP_MEND_MET     3e-16
#define KMP_MEND_STALLED 1e-12
/** Part of the misfit, or the square of the last digit, that may remain if rounding explains it. */
#define KMP_MEND_EXPLAINED 1e-2

/** Shortest finite motion, rad or characteristic lengths: its square is far above any closure tolerance. */
#define KMP_ROUNDING_FAR 0.25
/** Places with a last kept pivot below this part of the pivot at the start are near a change point: they do not count.
 */
#define KMP_ROUNDING_BESIDE 0.3
/** Part of the distant places at which a row must stay within the tolerance, so that its gap counts as rounding. */
#define KMP_ROUNDING_MOST_OF 0.7

/* -- closures: scaled |h|, the largest row ------------------------------------------------------------- */

/** Only rounding: a correction gains nothing. */
#define KMP_CLOSED_ROUNDING 4e-16
/** Rounding: not corrected at the end of a step, and no reason to reject the step. If lever lengths differ much, a
 * correction of this |h| exceeds fine tolerances. */
#define KMP_CLOSED 4e-15
/** Rounding if corrections no longer shrink. AFAR is for points far from the origin, times their distance over the
 * characteristic length: h is a difference of such numbers. */
#define KMP_CLOSED_STALLED 2e-14
#define KMP_CLOSED_AFAR    2e-15
/** Largest |h| of an assembled mechanism, accepted if rounding stops the corrections. */
#define KMP_CLOSED_ENOUGH 1e-11
/** A row that was dropped as redundant is not redundant beyond this |h|. */
#define KMP_CLOSED_DROPPED 1e-9
/** During a run a dropped row shows a change of rank when it exceeds both bounds: error weights of a coordinate of the
 * same unit, and a multiple of the widest kept row. With rounded numbers the bound is in closure tolerances, since the
 * summary warns of smaller gaps. */
#define KMP_DROPPED_WEIGHTS    1e3
#define KMP_DROPPED_OVER_KEPT  1e2
#define KMP_DROPPED_TOLERANCES 30
/** Below this |h| Newton's method is trusted to stay on its branch. */
#define KMP_CLOSED_NEAR 1e-4
/** Steps from a given state begin where |h| is at most this. Closing a wider gap would give another state. */
#define KMP_STEP_OPEN 1e-2
/** A pivot of J above this many |h| is not zero on the closed mechanism. */
#define KMP_CLOSED_DECIDED 10.0
/** Rates: |J qd + h_t| over the fastest consistent scaled rate. START is for rates that the user gives at the start. */
#define KMP_CLOSED_RATES 1e-9
#define KMP_CLOSED_START 1e-6
/** Joints with clearance at the start. RANK: of the product of a scaled row with its own change, the square of a pivot:
 * below the square of 1e-6 the ideal mechanism has a dead centre. DEEP: a compliant contact is not as deep as its
 * clearance. CENTRED: lengths over their clearance, so that their rounding is the rounding of places over a clearance.
 */
#define KMP_LOOSE_RANK    1e-12
#define KMP_LOOSE_DEEP    2
#define KMP_LOOSE_CENTRED 1e-9
/** Rates of a projected step, over the fastest: rounding of J qd; largest effect of rounding of h; margin for the rest
 * of that estimate; decay factor of the estimate from step to step. */
#define KMP_RATE_ROUNDING 1e-9
#define KMP_RATE_NOISE    1e-5
#define KMP_RATE_MARGIN   10.0
#define KMP_RATE_FADES    0.9

/* -- friction that sticks ------------------------------------------------------------------------------- */

/** Rates below this part of the fastest are none: rates at the event of a reversal are some roundings. */
#define KMP_FRICTION_STILL 1e-10
/** On a dae rates below this many relative tolerances of the fastest are none: its steps meet rates, also rates
 * of rows, within some tolerances. */
#define KMP_FRICTION_DRIFT 10.0
/** A rate against the direction of slip that counts as none, a part of the fastest: rounding of rates at rest. */
#define KMP_FRICTION_NONE 1e-13
/** Accelerations below this part of their terms are rounding: differences that make up D have lost some digits. */
#define KMP_FRICTION_ROUNDING 1e-10
/** Least part of its bound that a friction has where its event says that the bound is reached. */
#define KMP_FRICTION_TIE 1e-9
/** Part of a level by which D is found where accelerations are nonlinear in the forces: differences lose four digits,
 * and what is left of the nonlinearity is as small. */
#define KMP_FRICTION_UNIT 1e-4
/** A row whose pivot is below this part of the least one before it is not held: at a dead centre, as exactly as events
 * are located. The force that would hold it there is larger by the inverse. */
#define KMP_FRICTION_RANK 1e-7
/** Pivots of accelerations by forces of contacts, over the largest, that are zero: rounding of inverse inertia. */
#define KMP_SHARED_RANK 1e-9
/** Squares of forces, and of what bodies feel of them, that are rounding of these. */
#define KMP_SHARED_ROUNDING 1e-11
/** A level that changes by this part of a change of the forces is not felt: null vectors of D that is measured are
 * known to its square root. */
#define KMP_SHARED_UNFELT 1e-4
/** Least acceleration of slip in place of rest, over the accelerations without friction: above rounding of forces. */
#define KMP_SHARED_SLIDES 1e-5
/** Surfaces at a distance of this part of the size of the mechanism do not touch, whatever rounding makes of it. */
#define KMP_CONTACT_APART 1e-6
/** Compliance of contacts that presses them with given forces where rigid ones leave these open, over the inverse
 * inertia at the contact: errors of forces by it are far below KMP_SHARED_SLIDES. */
#define KMP_SHARED_SOFT 1e-6
/** Relative change of forces at which bounds of friction by them fit. */
#define KMP_SHARED_SETTLED 1e-8
/** Relative change of forces, levels or rates of contacts since they were examined that counts: rounding is less. */
#define KMP_SHARED_CHANGED 1e-7
/** Two elements with this relative gap of d_ik^2 to d_ii d_kk have one place, or multiples of it: rounding. */
#define KMP_FRICTION_ONE_PLACE 1e-12
/** Relative change of a force at which levels that depend on multipliers fit: some roundings. */
#define KMP_FRICTION_SETTLED 1e-14
/** An element that is regularised for a time has left when its rate is this many of its speeds: its friction then
 * differs from the level by 5e-5. */
#define KMP_FRICTION_LEFT 100
/** Parts of a run, of the two next kinds, last at most this number of times of its motion (the inverse of its rate at
 * the start): the end of a run may be unknown, or far away. */
#define KMP_FRICTION_SPAN 20
/** Part of a run: decisions within it are simultaneous. */
#define KMP_FRICTION_INSTANT 1e-13
/** The rate, in sizes of a place and rates of the motion, below which slip in two directions that begins has the
 * direction of its first acceleration. The error of its place is of the size of its square. */
#define KMP_FRICTION_BEGIN 1e-6
/** Modes that change CROWDED times within this part of the time of the motion, 1 over its rate, alternate without an
 * end: a run of ten such times would decide 1e8 times. Impacts that accumulate are a hundred at most. */
#define KMP_FRICTION_CROWD   1e-4
#define KMP_FRICTION_CROWDED 1000
/** Decisions without time between them that alternate. */
#define KMP_FRICTION_REPEATS 20

/* -- rigid contacts --------------------------------------------------------------------------------------- */

/** A distance below this many sizes is none: corners that strike together differ by the error of the positions. */
#define KMP_TOUCH_NEAR 1e-10
/** A force of a contact at rest that is none, in the largest work of a force along a coordinate: an equilibrium is
 * found to a residual of 1e-10, most to rounding. */
#define KMP_CONTACT_NONE 1e-9
/** An overlap that is none where a contact has opened, in sizes: some roundings of positions. Without a rate it opens
 * with the third power of the time, and is within rounding for longer. */
#define KMP_TOUCH_LIFT   1e-15
#define KMP_TOUCH_LIFTED 1e-13
/** Derivatives through an impact by its impulses: they explain the jump of the rates to this part, or to rounding of
 * the rates, whose difference the jump is. */
#define KMP_IMPACT_UNEXPLAINED 1e-7
#define KMP_IMPACT_RATES       1e-13
/** The same: rows whose pivots are below this part of the largest depend on others, as the corners of a body do. */
#define KMP_IMPACT_DEPENDENT 1e-10
/** A closed contact or friction that sticks stays so for all parameters only if the derivative of its rate is less than
 * this part of its terms: events are located to rounding. */
#define KMP_SLOPE_LOOSE 1e-6
/** The same of the distance of a contact, also where several strike together: a sequence of impacts is ended before its
 * limit, and leaves a part of this size. */
#define KMP_SLOPE_PARTS 1e-5
/** Events of one time have derivatives of it that are equal to this part, up to rounding. */
#define KMP_SLOPE_SAME_TIME 1e-6
/** The time, in characteristic ones, from the end of a table at which values are taken: above rounding of its place,
 * and without effect on slopes. */
#define KMP_SLOPE_ASIDE 1e-11
/** Conditions whose zero is farther away than this time, in characteristic ones, have jumped past it. */
#define KMP_SLOPE_JUMPED 1e-6
/** Rounding of derivatives, in sizes of coordinates over sizes of parameters. */
#define KMP_SLOPE_ROUNDED 1e-10
/** Tolerances of the adjoint method are of the weights at the end of the motion, which are at least this part of the
 * size of the target. */
#define KMP_ADJOINT_REACH 1e-2
/** Part of a run: an impact that follows the one before it within this time ends their sequence. The way to the limit
 * of the sequence is then below rounding of most positions, its square. */
#define KMP_IMPACT_SPACING 2e-7
/** The first step of a flight is at most this many times as long as the flight before. Dense output has the rounding of
 * the whole way of its step, and the last flights before a rest are shorter than steps by many powers of ten. No power
 * of two: the next flight is e times the last one, and with e = 0.5 halves of the step would end where it does. */
#define KMP_IMPACT_STEP 1.9
/** Height that an impact takes from a rebound, in overlaps at the located time, which are added to it: below this the
 * sequence ends. A dae has overlaps of the errors of its steps, other formulations of rounding. */
#define KMP_IMPACT_DEEP 4
/** Gain of kinetic energy in an impact, over that before it, that is rounding. */
#define KMP_IMPACT_GAIN 1e-9
/** Ratio of inertias between directions from which decisions about friction may fail by rounding, and the part of them
 * below which rows count as one. */
#define KMP_INERTIA_SPREAD 1e5
#define KMP_SAME_ROW       1e-14
/** Relative rounding of sums of impulses times the inverse inertia: some tens of roundings. */
#define KMP_IMPACT_ROUNDING 1e-14

/* -- corrections and steps ----------------------------------------------------------------------------- */

/** The longest move of a coordinate by one correction, rad or characteristic lengths. */
#define KMP_LONGEST_CORRECTION 0.5
/** Least bound on a correction from a distant guess: if no longer correction reduces |h| as predicted, the state is
 * stationary. */
#define KMP_SHORTEST_CORRECTION 1e-8
/** Least scaled damping of least changes; otherwise the damping is |h|. Its square exceeds the square of a singular
 * value that rounding leaves in J J' for redundant rows. */
#define KMP_LEAST_DAMPING 1e-6
/** A larger closure correction, in error weights, rejects a step. */
#define KMP_CORRECTION_LIMIT 1.0
/** A larger correction of integrated v rejects a step when rows are dropped: each choice of rows has another motion off
 * the closures, of which the error estimate covers less. With 1 errors are 4 to 8 times as large, with 1e-2 twice. */
#define KMP_CORRECTION_REDUNDANT 3e-3
/** Smaller scaled corrections are compared only with KMP_CORRECTION_LIMIT: some are due to rounding of h. */
#define KMP_CORRECTION_ROUNDING 1e-13
/** Newton in an evaluation stops at this fraction of the error weights. The fused program has its accelerations before
 * the last correction: with 1e-2 errors of the newton form are 2 to 4 times as large. */
#define KMP_CORRECTION_IN_STAGE 1e-3
/** Dependent coordinates are predicted by the progress of the independent ones, which is a time: their change over
 * their rates. It is at most this many times the time since the last step. From rest, rates of 1e-20 made it endless.
 */
#define KMP_PREDICTED_PROGRESS 4.0
/** Largest multiplier of an elimination in a given order, rows scaled, for which its order is good. */
#define KMP_ELIMINATION 10.0
/** Scaled correction of v at which stages of a step in lanes are closed: it is added, and J is that before it, so that
 * accelerations have an error of this size. In the first sweep a later one makes it good. In later ones it is a part of
 * the change of u, which is the change of the sweep before: sweeps contract by more. Rounding of h begins at the first.
 */
#define KMP_CORRECTION_IN_LANES       1e-13
#define KMP_CORRECTION_FIRST_IN_LANES 1e-7
#define KMP_CORRECTION_LATER_IN_LANES 1e-3
/** Largest angle (rad) by which a correction of v turns sines and cosines by series: their error, its fifth power over
 * 120, is 8e-18. After a larger one they are computed again. */
#define KMP_TURN_SMALL 1e-3
/** Last Newton correction of a state from which a step across a change point starts: the error is its square. */
#define KMP_CORRECTION_LAST 1e-8

/* -- growth: scaled |Bvu| ------------------------------------------------------------------------------ */

/** Exchanges continue as long as they enlarge |det Jv| by this factor: 1 would never end on ties. */
#define KMP_PICK_GROWTH 1.5
/** Growth at which u and v are exchanged: GROWTH for Kempe's choice, WISH for the user's, CLOSED in the newton form.
 * Its right-hand side is a function only of u, whose series converges only up to u's dead centre: much of its error is
 * made near it. Below 1.3 nothing is gained at equal error (docs/decisions/forms.md). An integrator that restarts at
 * each exchange takes GROWTH, since it would lose more than it gains. VARIED: with sensitivities, which grow faster
 * towards the dead centre than the motion. */
#define KMP_EXCHANGE_GROWTH 1.5
#define KMP_EXCHANGE_CLOSED 1.3
#define KMP_EXCHANGE_VARIED 1.1
#define KMP_EXCHANGE_WISH   10.0
/** Tolerance of the run that finds the choices for which the right-hand side of a simulator is written out: it follows
 * the motion of a model for some seconds, and only the order of the choices counts. */
#define KMP_TRIAL_TOLERANCE 1e-6
/** Growth limits without integration, where only digits matter. Equilibria take few steps, so that a good choice costs
 * little; sweeps and prescribed motions take many. */
#define KMP_EXCHANGE_STILL 2.0
#define KMP_EXCHANGE_SWEEP 3.0
#define KMP_EXCHANGE_LED   4.0
/** A user's choice is rejected if its |Bvu| exceeds this at the start. */
#define KMP_GROWTH_WISH 1e4
/** Beyond this growth a fixed u is given up: errors of u reach v multiplied by it. */
#define KMP_GROWTH_LIMIT 1e3
/** Scaled change of v for rows that open by their scale. Beyond it, the last pivot of Jv may be zero, and the rank is
 * decided again. */
#define KMP_GROWTH_LEVER 1e6
/** Above this growth a step that became too small is attributed to the choice of u. */
#define KMP_GROWTH_EXPLAINS 20.0

/* -- axes of three angles: their determinant, over its largest ----------------------------------------- */

/** Below CENTRED, a joint's angles are centred before a run continues; below TURNED, assembly centres them. Below WEAK,
 * fixed angles are reported as singular; below LOST, derivatives by the angles have lost too many digits. */
#define KMP_AXES_CENTRED 0.4
/** Above this, lanes take an instance back: the user's angles have left their singular position by so much that they do
 * not return to it at once. */
#define KMP_AXES_RESUMED 0.6
#define KMP_AXES_TURNED  0.1
#define KMP_AXES_WEAK    0.05
#define KMP_AXES_LOST    0.02
/** Axes are dependent: rounding of their components. NO_ANGLE: the sine below which the first angle is not determined.
 * TOUCH: the distance (rad) within which an angle is set beyond its singular position, not followed through it. */
#define KMP_AXES_DEPENDENT 1e-14
#define KMP_AXES_NO_ANGLE  1e-15
#define KMP_AXES_TOUCH     1e-8
/** Joints below ALONG are centred together with a due one, which restarts an integrator less often. NEAR_BY: angles
 * that change by less are continuous, rad. */
#define KMP_AXES_ALONG   0.8
#define KMP_AXES_NEAR_BY 1.0

/* -- events -------------------------------------------------------------------------------------------- */

/** Part of a run, in simulators of the time of the motion: changes of one condition within it are simultaneous. At most
 * this number of them follow each other without time between them. */
#define KMP_EVENT_INSTANT 1e-11
#define KMP_EVENT_REPEATS 20
/** A kink is fixed beyond this many tolerances of its largest value: within them the errors of steps exceed its effect.
 */
#define KMP_KINK_TOLERANCES 100
/** Part of a step up to an event by which the step that is made again is longer: its end is surely beyond the event.
 * NEAR: part of a step, near its start, at which the value of a kink that is zero at the start, as at rest, has its
 * sign. AT_ONCE: part of a step at whose beginning its polynomial is right in any case; a step that
 * is made again where equations are not smooth is longer by it, as they are then wrong in its square. */
#define KMP_STEP_BEYOND  1e-3
#define KMP_STEP_NEAR    (1.0 / 1024)
#define KMP_STEP_AT_ONCE 1e-6

/* -- motions that grow without end --------------------------------------------------------------------- */

/** The growth of unknowns over their usual size, and of scaled rates over the rate of the motion, below which a motion
 * is never ended. */
#define KMP_GROWTH_USUAL 10
#define KMP_GROWTH_RATES 1000
/** Each decade of an exponential function takes as long as the last one; of t^10, 1.26 times as long. */
#define KMP_GROWTH_STEADY 1.25
/** Attempted steps between two tests of the growth, and the fewest steps of a motion that may be ended. */
#define KMP_GROWTH_LOOKS 16
#define KMP_GROWTH_STEPS 20000

/* -- only generated simulators: they have no program that carries lambda, and callers that set states ---- */

/** Relative change of multipliers at which forces that depend on them are at them, and where rounding stops it. */
#define KMP_LOADS_SETTLED 1e-14
#define KMP_LOADS_ROUNDED 1e-9
/** Pivot of the reduced mass over its diagonal: no mass. */
#define KMP_NO_MASS 1e-13
/** Change of rates where modes change the closures, over the fastest one: less is rounding of J qd. */
#define KMP_RATES_JUMP 1e-9
/** A longer correction comes from a distant guess of a caller, which is approached in parts; rad or characteristic
 * lengths. */
#define KMP_TRUSTED_CORRECTION 0.1
/** Largest relative change of a parameter between two of the differences of sixth order by which start values are
 * differentiated: their error is below 1e-13 of smooth expressions. */
#define KMP_START_DIFFERENCE 3e-3
/** Communication points of a co-simulation differ by this part of the time, in s, from the time that a unit has
 * reached: they are sums of rounded steps. */
#define KMP_SAME_COMMUNICATION 1e-9
/** Growth at which an integrator of a caller, which restarts then, is asked to exchange coordinates. */
#define KMP_EXCHANGE_CALLERS 3.0

/* -- margins: the least singular value of the independent rows of the scaled J, over its usual size --- */

/** IN: the margin below which a run steps across a change point straight ahead. OUT: the margin at which the
 * formulation takes over after the step. LEFT: the margin above which the surroundings of a place that no step could
 * cross are left. GROWING bounds the next step of an ensemble's lane over the last one. */
#define KMP_NEAR_SINGULAR_IN   0.15
#define KMP_NEAR_SINGULAR_OUT  0.03
#define KMP_NEAR_SINGULAR_LEFT 0.2
#define KMP_GROWING            1.5
/** AIM: least predicted margin along the line ahead, below which the line meets a change point. STEEP: that margin
 * relative to the present one, so that small margins by themselves raise no alarm. Mechanisms that pass at one or a few
 * hundredths are resolved by ordinary steps. */
#define KMP_MARGIN_AIM   1e-2
#define KMP_MARGIN_STEEP 0.3
/** If J at the predicted place has at most this part of the present margin, the place is a change point. */
#define KMP_MARGIN_THERE 2e-2
/** No step of an ordinary formulation ends below this margin near a change point: its stages come nearer still. */
#define KMP_MARGIN_DEEP 0.1
/** If no step across was found because the motion turns, the next one is tried at this part of the margin. */
#define KMP_MARGIN_AGAIN 0.1
/** Least pivots above this part of their usual size need no further examination. */
#define KMP_MARGIN_CALLS 0.4
/** A step has passed a singular place when the cosine of the turn of w is below TURNED, and the margin came below
 * PASSED times its usual size. */
#define KMP_MARGIN_TURNED -0.5
#define KMP_MARGIN_PASSED 0.3
/** LOOK: a last pivot of the start below this part of the first is examined. NEAR: it is near a change point when its
 * margin is below this part of the margin at configurations displaced a little along the closures. */
#define KMP_MARGIN_LOOK 1e-2
#define KMP_MARGIN_NEAR 0.04
/** A margin below LOCKED is due to one row if leaving out that row raises it above FREED. */
#define KMP_MARGIN_LOCKED 0.1
#define KMP_MARGIN_FREED  0.2
/** A margin below EXACT on a followed branch is a change point, where branches meet. It is crossed in the direction of
 * motion from the place where the margin was above ENTRY. */
#define KMP_MARGIN_EXACT 1e-6
#define KMP_MARGIN_ENTRY 1e-3
/** A step that became too small is attributed to a change point below EXPLAINS. A motion that is later followed
 * backwards ends below ENDS, which only a change point reaches. */
#define KMP_MARGIN_EXPLAINS 0.02
#define KMP_MARGIN_ENDS     1e-4
/** Largest rounding of accelerations with the loops open, as a part of rtol, over the accelerations at the start. */
#define KMP_MARGIN_CANCELLED 1e-2
/** The search for a change point farther ahead continues while each look reduces the margin by this factor. If the
 * motion comes to rest at one, the margin decreases as the square of time, and the line meets zero half-way. */
#define KMP_MARGIN_AHEAD 0.6
/** The singular vector w: the columns of its iteration are chosen again if another one contains STALE times more of w.
 * Conjugate gradients end at GAP, relative. The vectors of two places are the same above the cosine SAME. */
#define KMP_MARGIN_STALE 4.0
#define KMP_MARGIN_GAP   1e-6
#define KMP_MARGIN_SAME  0.5
/** Displacement of the free coordinates, rad or characteristic lengths, within which the least singular value reaches
 * its usual size. ELSEWHERE: displacement of all coordinates to other configurations for comparison. */
#define KMP_MARGIN_NEAR_BY   0.2
#define KMP_MARGIN_ELSEWHERE 0.5

/* -- steps across a change point: polynomials in time --------------------------------------------------- */

/** Relative size of the last terms at which the polynomial is smooth. Picard's iteration is carried to SETTLED of
 * SMOOTH, must shrink by SHRINKS, and may end in NOISE times it. Beyond ROUGH, or ROUGH times the last change, it is
 * given up. */
#define KMP_SINGULAR_SMOOTH  1e-9
#define KMP_SINGULAR_SETTLED 1e-2
#define KMP_SINGULAR_SHRINKS 0.7
#define KMP_SINGULAR_NOISE   10.0
#define KMP_SINGULAR_ROUGH   100.0
/** Relative difference of equal lengths of steps across; a landing may be BEYOND times as far as predicted. */
#define KMP_SINGULAR_SAME   1e-4
#define KMP_SINGULAR_BEYOND 1.3
/** Coefficients |T| of dropped rows in the kept ones. Beyond OUT (SWEEP in sweeps) a dropped row replaces a kept one,
 * which enlarges |det Jv| by that factor; a step that ends beyond LOST goes too far. OUT: at 1.5 the rows of a parallel
 * robot change ten times in a turn, each time with a new formulation; at 3 errors of two-armed lamps double. */
#define KMP_ROWS_OUT   2.0
#define KMP_ROWS_LOST  30.0
#define KMP_ROWS_SWEEP 3.0
/** Largest scaled Bvu of a closed-chain Jacobian: beyond it an independent coordinate is at a dead centre. A state
 * that is closed there to rounding, eps in h, has sqrt(eps) in the angle, and 1e8 in Bvu. */
#define KMP_TANGENT_SINGULAR 1e6
/** Difference of value and rate, relative or over the characteristic length, at which an input of a closure that a
 * caller sets continues: callers compute both again, with rounding. The next closing of the loops takes it up. */
#define KMP_INPUT_CONTINUOUS 1e-9
/** Entries below this part of a row of size 1 are rounding: their squares add nothing. */
#define KMP_ROWS_NOTHING 1e-12

/* -- samples ------------------------------------------------------------------------------------------- */

/** Least square of a pivot of a matrix of correlations: below it quantities determine each other, or contradict. */
#define KMP_CORRELATION_LEAST 1e-12
/** Least share of a normal distribution between its limits: of a smaller one quantiles lose six digits. */
#define KMP_TRUNCATED_LEAST 1e-6

/* -- fits ---------------------------------------------------------------------------------------------- */

/** Singular values of the Jacobian of a fit, columns of norm 1, times the rtol of its runs: below this part of the
 * first one they are errors of the derivatives, which are promised to a hundred tolerances. */
#define KMP_FIT_RANK 100.0
/** Step of differences of whole runs, relative to a parameter: with four places the derivative has errors of rtol over
 * it, and of its fourth power. */
#define KMP_RUN_STEP 2e-3
/** Components of a direction that the data does not determine: smaller ones are rounding of the others. */
#define KMP_FIT_MEMBER 0.01
/** A parameter this near to its bound, over its range, is at it: there the search moves by the root of its tolerance.
 */
#define KMP_FIT_BOUND 1e-5
/** Relative change of the sum of squares and of the parameters that ends a search. The error of an estimate is then
 * 1e-5 of its standard error. */
#define KMP_FIT_ENOUGH 1e-10
/** Relative change of a column's weight with which weights are settled: it changes estimates by a hundredth of their
 * standard errors at most. */
#define KMP_FIT_WEIGHTS 0.01
/** Measurements of a column beyond the number of parameters: with fewer its residuals show no deviation. For a mass, a
 * spring and a damper, 300 seeds, intervals of 95 % with 4 to 11 measurements then hold in 91 to 100 %
 * of the cases (bench/results/fit_coverage.txt). */
#define KMP_FIT_FEW 5
/** Residuals of a column over its own deviation, beyond which a fit has not found its motion: half of it is
 * unexplained. */
#define KMP_FIT_UNLIKE 0.5
/** Correlation of neighbouring residuals beyond which they are not noise: of 20 independent ones it exceeds 0.7 once in
 * ten thousand times (200,000 draws). */
#define KMP_FIT_ALIKE 0.7
/** The least noise of a column, times the rtol of the runs and its scatter: below it residuals are errors of the runs,
 * which are promised to a hundred tolerances. */
#define KMP_FIT_NOISE 100.0
/** Deviations of the noise by which a fitted motion may change at a hundredfold tolerance. */
#define KMP_FIT_COARSE 0.1

/* -- optimisation -------------------------------------------------------------------------------------- */

/** Relative change of the quantity, and of the parameters over their ranges, that ends a search: the value of the
 * default tolerance of runs. */
#define KMP_OPTIMUM_ENOUGH 1e-8
/** A limit is kept up to this part of its bound: a search ends on it up to the error of its runs, which are promised to
 * a hundred tolerances. */
#define KMP_OPTIMUM_KEPT 1e-6

/* -- limit cycles -------------------------------------------------------------------------------------- */

/** Relative tolerance of runs over a period; the absolute one is this part of the largest motion of the cycle.
 * Multipliers and values of the parameter then have eight digits or more. */
#define KMP_CYCLE_RTOL 1e-10
/** The first cycle from a Hopf point: its largest motion in characteristic sizes. It is small against clearances, and
 * errors of closed positions are small against it. A branch ends in a Hopf point at this part of that amplitude. */
#define KMP_CYCLE_FIRST 1e-4
#define KMP_CYCLE_LAST  0.9
/** The first cycle is near its Hopf point if the parameter differs by less than this part of the range: a hundredth is
 * the accuracy to which a diagram is read. */
#define KMP_CYCLE_NEAR 1e-2
/** A correction of this part of the cycle ends Newton's method, whose next correction would be of the order of its
 * square: below the error of the runs. */
#define KMP_CYCLE_CORRECTED 1e-7
/** Part of the largest motion in a unit below which the motion of a coordinate does not count in convergence. */
#define KMP_CYCLE_STILL 1e-3
/** Multipliers this near to the unit circle are on it: some hundred errors of a run. The distance of the multiplier
 * that is 1 from 1, times the other number, counts where it is larger. */
#define KMP_CYCLE_ON_CIRCLE 1e-7
#define KMP_CYCLE_ERRORS    10.0
/** Steps along a branch, over the size of the last cycle and, for the parameter, this part of its range: the longest,
 * the first and the shortest one; the largest angle between two tangents, rad, also of the deviation from the first
 * one, unless a step is as short as at a corner of the branch, where a contact begins. A longer step than SURE that
 * leads to another number of growing multipliers may have led to another part of the branch. */
#define KMP_CYCLE_RANGE    0.1
#define KMP_CYCLE_LONGEST  0.5
#define KMP_CYCLE_BEGIN    0.2
#define KMP_CYCLE_SHORTEST 1e-6
#define KMP_CYCLE_ANGLE    0.35
#define KMP_CYCLE_CORNER   2e-3
#define KMP_CYCLE_SURE     0.05
/** A fold, and a change of stability, are found to this part of a step. */
#define KMP_CYCLE_LOCATED 1e-9
#define KMP_CYCLE_CHANGED 1e-6
/** Part of the range of a parameter that does not count as a difference: cycles of a conservative motion have one
 * value, known to the error of the runs, up to this many times the first amplitude, a hundred characteristic sizes.
 * Elsewhere the parameter changes as the square of the amplitude, or as its fourth power, or from the amplitude on at
 * which a force begins. */
#define KMP_CYCLE_LEVEL  1e-9
#define KMP_CYCLE_CENTRE 1e6
/** A simulated motion has settled if its amplitudes in two windows, the third and the last quarter of the simulation,
 * differ by this part: the accuracy to which a diagram is read. One of less than this part of the largest is at rest.
 */
#define KMP_CYCLE_SETTLED 1e-3
#define KMP_CYCLE_RESTS   1e-6
/** One that decays, of less than this part of the largest, is at rest soon. */
#define KMP_CYCLE_DECAYED 1e-2
/** Range of an output over a whole simulation, SI, below which it has not been disturbed: rounding of an equilibrium.
 */
#define KMP_CYCLE_UNMOVED 1e-12
/** The mean of a load over a period is known if the means of every other value differ by less than this part of it: the
 * accuracy to which a diagram is read. */
#define KMP_CYCLE_MEAN 1e-2
/** An output whose values at both ends of a period differ by this part of its range is not periodic, such as the
 * distance that a vehicle travels. */
#define KMP_CYCLE_ADVANCES 1e-5
/** Rows resolve an output of a cycle if extremes of every other row differ by less than this part of its range; corners
 * are rows that are this part of the range off the curve through their neighbours. */
#define KMP_CYCLE_UNRESOLVED 1e-5
#define KMP_CYCLE_BENT       1e-3

/* -- error control ------------------------------------------------------------------------------------- */

/** Absolute tolerance of an entry that is integrated with the others and does not limit the step: the work of forces,
 * and the position of a state, which is the integral of that state. */
#define KMP_UNCONTROLLED 1e300
/** Differences of the unknowns, over their sizes, for the largest eigenvalue at the start: far above rounding, and
 * small enough for a value with one digit. */
#define KMP_FASTEST_DIFFERENCE 1e-7

/* -- times --------------------------------------------------------------------------------------------- */

/** Times that differ by this part are one time: multiples of two sample times that are decimal numbers differ there by
 * some roundings of 1.1e-16 each. */
#define KMP_SAME_TIME 4e-15
/** The length of a run that falls short of whole windows of comfort by this part of a window has them: it is a sum of
 * rounded times. */
#define KMP_WINDOW_SLACK 1e-9
/** Wheels at the start of a run that press with more than this part of the weight of all bodies are not static loads:
 * an elastic contact that begins with a wrong depth has many times as much. */
#define KMP_CARRIED_MOST 1.1
/** With every other sample a value of ride comfort may differ by this part without a warning: such values are given to
 * two or three digits. */
#define KMP_COMFORT_HOLDS 0.01
/** Velocities of places that an impact changes by this part of its largest jump are rounding. */
#define KMP_COMFORT_JUMP 1e-9
/** The past of a delayed signal is a polynomial whose last coefficient is this part of the tolerance of a step: its
 * error, which is smaller still, then adds nothing to the error of the steps. Rounding of closed positions, relative.
 */
#define KMP_PAST_PART     0.1
#define KMP_PAST_ROUNDING 1e-14
/** An event is at a state where a coordinate or a rate, this part of its size away, has the other side: an equilibrium
 * is known to about 1e-10. */
#define KMP_EVENT_HERE 1e-8
/** Matrices of small motions on both sides of such an event are the same where their entries differ by less than this
 * part of the largest of a row, or by this part of a size by the masses and the fastest rate. */
#define KMP_SIDES_DIFFER   1e-6
#define KMP_SIDES_ROUNDING 1e-10
/** A gap or a length at the start as it is written, and closed, differ by less than this part of the characteristic
 * length: start values of six digits are closed ones. */
#define KMP_START_CLOSED 1e-6
/** Part of its time by which a row at an event is before it: some roundings. */
#define KMP_BEFORE_EVENT 1e-14
/** Small motions with delays: roots of the characteristic equation below this part of the frequency beyond which
 * only inertia counts are zero. */
#define KMP_DELAYED_STILL 1e-7
/** A root of that equation is one where its residual is this part of the terms of each row: some roundings of them. */
#define KMP_DELAYED_ROOT 1e-12
/** An eigenvalue of the discretised delays represents the root that is within this part of its size: those near the
 * origin are known to many digits, the farthest ones to none. Two roots from different starts that are as near are
 * one. */
#define KMP_DELAYED_NEAR 1e-4
/** A time is a multiple of a sample time up to this part, in studies that find when samples of several times repeat:
 * times are decimal numbers, or parameters that were divided. */
#define KMP_SAME_SAMPLE 1e-9
/** A motion whose z from sample to sample is this small is over within a sample: ln(z) of rounding means nothing. */
#define KMP_SAMPLED_OVER 1e-8
/** A real part of ln(z)/T is zero, relative to the largest modulus: z has passed an exponential. */
#define KMP_SAMPLED_STILL 1e-9
/** An eigenvalue z is the 1 of a free motion that the averaged equations have exactly: a double one is the root of
 * rounding away, a triple one its cube root. */
#define KMP_SAMPLED_ONE 1e-4
/** A flexible body that deflects by more than this part of its length is out of the range of shapes with terms of
 * second order, whose places are off by the cube of the slope: by a part of 1e-3 of the length there. */
#define KMP_DEFLECTION_LARGE 0.1

/** Between the places where a step is evaluated, a deflection may exceed that part by about half of this part of it. */
#define KMP_DEFLECTION_SLACK 0.01

/** The value of the condition of deflections for half of that part. Smaller deflections at the ends of a step are not
 * searched within it. */
#define KMP_DEFLECTION_SMALL 0.75
/** A flexible body without terms of second order may turn with this part of its first frequency: its stiffness is then
 * off by the square, some percent. */
#define KMP_ROTATION_SLOW 0.3
/** A flexible body whose file lacks centrifugal terms of the deformed body, or Oe: they are a part of the stiffness of
 * at most the square of its rate by its first frequency, one percent here. */
#define KMP_ROTATION_AVERAGED 0.1
/** Moments of a section by its loads and by the strain of shapes that differ by more than this part of the largest one
 * are not resolved. */
#define KMP_SECTION_RESOLVED 0.05
/** Moments of sections below this part of forces times the length are rounding. */
#define KMP_SECTION_REST 1e-9
/** Explicit integrators take steps of at most this over the fastest frequency: the limit of stability of DOP853 is
 * about 6 on the imaginary axis. */
#define KMP_EXPLICIT_REACH 5.0
/** A joint or closure loads a flexible body in a direction where its load is more than this part of the largest one:
 * smaller parts are due to the closing of the start. */
#define KMP_LOAD_UNSHAPED 1e-7
/** Loads of less than this many times the start buckle a flexible body: it is warned of, because a load that begins at
 * once deflects it twice as far as one that grows slowly. Parts of the stiffness below the second number are of no
 * concern, and are not mentioned. */
#define KMP_BUCKLING_NEAR 2.0
#define KMP_BUCKLING_NONE 1e-3
/** Largest deflection of a body that has stayed straight, a part of its length: rounding. */
#define KMP_DEFLECTION_NONE 1e-12
/** Deformations of a static start are found where a step is below this part of the length, or where steps below the
 * second part no longer shrink: rounding of forces over soft stiffness. Generated simulators have differences of the
 * third part. */
#define KMP_STATIC_STEP       1e-13
#define KMP_STATIC_ROUNDED    1e-9
#define KMP_STATIC_DIFFERENCE 1e-7
/** Directions of a flexible body whose inertia is this part of the largest one move no mass, but for rounding. */
#define KMP_FLEXIBLE_STILL 1e-13

/* -- joints of constant velocity ---------------------------------------------------------------------- */

/** Degrees between the shafts. Fixed joints reach 50, wide ones 60. The row has its pole at half a turn, where a
 * moment of the size 1/cos(angle/2) would be needed for a torque of 1: 115 at the second angle. */
#define KMP_SHAFTS_BENT   60.0
#define KMP_SHAFTS_FOLDED 179.0

/** The second derivative of a spline is continuous at its knots but for rounding, which is below this part of it: its
 * coefficients follow from differences of values with nine digits or more. A kink is of the size of the derivative. */
#define KMP_BENDS_ALIKE 1e-6

/* -- cams --------------------------------------------------------------------------------------------- */

/** An ideal cam pulls its follower where the negative force exceeds this part of the largest force of a run. Smaller
 * negative forces are rounding. */
#define KMP_PULLING_FORCE 1e-9

/** The place of contact on a cam is found to this part of its profile. The distance of the follower is stationary
 * there, so that its error is the square; between 2048 nodes of the search an acceleration has the square of the rate
 * of the error, some 1e-12. */
#define KMP_CAM_FOUND 1e-10

/** Written angles, over a turn, and written lifts and lengths, over the largest, are equal within this: files have nine
 * digits. */
#define KMP_WRITTEN_DIGITS 1e-9

/** Sines of angles between axes, and distances over the size of a mechanism, that count as zero: written places and
 * axes have nine digits. */
#define KMP_SAME_AXIS 1e-9

/* -- outlines ----------------------------------------------------------------------------------------- */

/** The sine of a corner that counts as none, and over the size of an outline the height over a tangent that counts as
 * none: both follow from places with nine digits. */
#define KMP_OUTLINE_TANGENT 1e-8
/** The sine of the angle of an arc through three places below which they are on a line: they are written with nine
 * digits. */
#define KMP_OUTLINE_STRAIGHT 1e-9
/** Over the size of an outline: a start that is deeper overlaps. A start that is computed from an equation has this
 * error. */
#define KMP_OUTLINE_DEEP 1e-8
/** Over the size of an outline: both sides of a sharp corner out of the solid continue by this for a point. Two
 * corners that meet within it touch by both sides, because rounding would select one. */
#define KMP_OUTLINE_CORNER 1e-9
/** The sine of the angle by which an edge of a sharp corner may be behind a line that the corner touches: edges that
 * lie on the line have errors of steps. Sides of a corner that turn by less are one side. */
#define KMP_OUTLINE_FACES 1e-4
/** The cosine of the turn of a corner below which the surface behind it may be near the line across its end. Then the
 * line that halves the corner is a border, too. */
#define KMP_OUTLINE_OBTUSE 0.5
/** Over the distance at which nothing touches: a border is passed by this, so that a body at rest on it stays on one
 * side. The distance of the neighbour differs by the square of it. */
#define KMP_OUTLINE_LAG 1e-12
/** The sine of the angle between copies that is rounding. */
#define KMP_OUTLINE_FOLD_LAG 1e-12
/** Parts of the thickness of the solid. A circle deeper than the first one belongs to the other side; one as deep as
 * the second one has passed through the surface, which ends the run before it counts on the other side. */
#define KMP_OUTLINE_OTHER_SIDE 0.5
#define KMP_OUTLINE_INSIDE     0.45

/* -- tables of wheel-rail contact --------------------------------------------------------------------- */

/** A conicity is resolved by the values of a table if half of them change it by at most this part of it, or of a small
 * conicity: 5 values of a worn profile change it by 0.72 of it, 181 values by 0.004. */
#define KMP_CONICITY_RESOLVED 0.1
#define KMP_CONICITY_SMALL    0.02
/** Steps between values in the least amplitude: with fewer the whole motion may lie between two values, where half of
 * them change nothing. */
#define KMP_CONICITY_STEPS 1.25

/** A tyre leaves its road where its deflection is below minus this part of the radius: rounding of the deflection. */
#define KMP_TYRE_LAG 1e-15

/** A run ends where the cosine of a tyre's inclination falls to this: there the directions of its contact are lost. */
#define KMP_TYRE_LEANS_MOST 0.1
