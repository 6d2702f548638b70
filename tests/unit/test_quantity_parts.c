/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of a step in the account of quantities: integrals of functions with a kink against closed forms, and the number
 * of states that they need. */
#include "integrators/quantities/run_quantities.h"
#include "integrators/quantities/smooth_piece.h"
#include "testing.h"
#include <math.h>

enum { POINTS = KMP_PIECE_POINTS, ROOM = 200, LEVELS = 64 };

typedef struct course {
    double kink;       /* of |t - kink| */
    int states, parts; /* that were requested */
    int refused;       /* parts from this level on are not given */
    double from, to;   /* the step */
} course;

static const kmp_run_quantity integral = {.kind = KMP_TAKE_INTEGRAL};
static const int channel[] = {-1};
static const kmp_run_quantities one = {
    .count = 1, .channels = 1, .values = 1, .of = &integral, .shown = channel, .inside = true};

static bool at(void *user, double t, double *values)
{
    course *c = user;
    c->states++;
    *values = fabs(t - c->kink);
    return true;
}

static bool part_of(void *user, int halvings, int index, double *piece)
{
    course *c = user;
    if (halvings >= c->refused)
        return false;
    c->parts++;
    double size = ldexp(c->to - c->from, -halvings), from = c->from + index * size;
    for (int k = 1; k < POINTS - 1; k++)
        piece[k] = fabs(from + 0.5 * (1 + kmp_piece_point(k)) * size - c->kink);
    return true;
}

static double integral_of(course *c, bool parts)
{
    double account[LEVELS], room[ROOM], end = 0, value;
    CHECK(kmp_account_size(&one) <= LEVELS && kmp_account_room(&one) <= ROOM);
    const kmp_measured_step step = {
        .from = c->from, .to = c->to, .rtol = 1e-12, .parts = parts ? part_of : NULL, .channels = at, .user = c};
    kmp_account_begin(&one, account);
    CHECK(kmp_account_step(&one, account, room, &step));
    kmp_account_values(&one, account, c->from, c->to, &end, &value);
    return value;
}

/* A straight line is one piece of 9 states. A kink halves it ten times; each half has its ends from the piece before,
 * and so 7 states of its own. The error of the integral is of the order of the square of the last part. */
static void halves_share_their_ends(void)
{
    course line = {.kink = -1, .to = 1}, kinked = {.kink = 0.3, .to = 1};
    CHECK_NEAR(integral_of(&line, false), 1.5, 1e-14);
    CHECK(line.states == POINTS);
    CHECK_NEAR(integral_of(&kinked, false), (0.3 * 0.3 + 0.7 * 0.7) / 2, 1e-7);
    CHECK(kinked.states == POINTS + 10 * 2 * (POINTS - 2));
}

/* Parts that are given need no states beyond the first piece; those that are refused are taken one by one. */
static void parts_are_the_same(void)
{
    course alone = {.kink = 0.3, .to = 1}, given = {.kink = 0.3, .to = 1, .refused = 100},
           some = {.kink = 0.3, .to = 1, .refused = 4};
    double value = integral_of(&alone, false);
    CHECK_NEAR(integral_of(&given, true), value, 1e-15);
    CHECK(given.states == POINTS && given.parts == 20);
    CHECK_NEAR(integral_of(&some, true), value, 1e-15);
    CHECK(some.parts == 6 && some.states == POINTS + 7 * 2 * (POINTS - 2));
}

int main(void)
{
    TEST(halves_share_their_ends);
    TEST(parts_are_the_same);
    return check_report();
}
