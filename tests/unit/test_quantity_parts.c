/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of a step in the account of quantities: kinks, waves, pulses and jumps within one step against closed forms,
 * the number of states that they need, and what ends at the bound of work. */
#include "base/text.h"
#include "output/quantities/run_quantities.h"
#include "output/quantities/smooth_piece.h"
#include "testing.h"
#include <math.h>
#include <string.h>

enum { POINTS = KMP_PIECE_POINTS, ROOM = 1000, LEVELS = 64 };

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

/* A straight line is one piece of 9 states. A kink is halved until its part is below the tolerance; each half has its
 * ends from the piece before, and so 7 states of its own. */
static void halves_share_their_ends(void)
{
    course line = {.kink = -1, .to = 1}, kinked = {.kink = 0.3, .to = 1};
    CHECK_NEAR(integral_of(&line, false), 1.5, 1e-14);
    CHECK(line.states == POINTS);
    CHECK_NEAR(integral_of(&kinked, false), (0.3 * 0.3 + 0.7 * 0.7) / 2, 1e-11);
    CHECK(kinked.states > POINTS && (kinked.states - POINTS) % (2 * (POINTS - 2)) == 0);
    CHECK(kinked.states <= POINTS + 25 * 2 * (POINTS - 2));
}

/* Parts that are given need no states beyond the first piece; those that are refused are taken one by one. */
static void parts_are_the_same(void)
{
    course alone = {.kink = 0.3, .to = 1}, given = {.kink = 0.3, .to = 1, .refused = 100},
           some = {.kink = 0.3, .to = 1, .refused = 4};
    double value = integral_of(&alone, false);
    CHECK_NEAR(integral_of(&given, true), value, 1e-15);
    CHECK(given.states == POINTS && (POINTS - 2) * given.parts == alone.states - POINTS);
    CHECK_NEAR(integral_of(&some, true), value, 1e-15);
    CHECK(some.parts == 6 && (POINTS - 2) * some.parts + some.states == alone.states);
}

/* -- values against closed forms ------------------------------------------------------------------------ */

/* A function of time over one long step, and its argument. */
typedef struct wave {
    double (*of)(double t);
    double (*argument)(double t);
    int states;
} wave;

static bool wave_at(void *user, double t, double *values)
{
    wave *w = user;
    w->states++;
    values[0] = w->of(t);
    if (w->argument)
        values[1] = w->argument(t);
    return true;
}

/* The value of a quantity of a wave from 0 to 10; false: the bound of work is reached. */
static bool take_of(wave *w, kmp_run_quantity quantity, kmp_argument_kind kind, double *values)
{
    static double account[LEVELS], room[2 * ROOM];
    static const char *const names[] = {"x", "x.time"};
    const kmp_run_argument argument = {.kind = kind};
    const int shown[] = {-1, -2};
    const kmp_run_quantities q = {.count = 1,
                                  .channels = w->argument ? 2 : 1,
                                  .values = 2,
                                  .of = &quantity,
                                  .name = names,
                                  .arguments = w->argument != NULL,
                                  .argument = &argument,
                                  .shown = shown,
                                  .inside = true};
    const kmp_measured_step step = {.to = 10, .rtol = 1e-8, .channels = wave_at, .user = w};
    CHECK(kmp_account_size(&q) <= LEVELS && kmp_account_room(&q) <= sizeof room / sizeof *room);
    double end[2] = {0};
    kmp_text why = {0};
    kmp_account_begin(&q, account);
    bool good = kmp_account_step(&q, account, room, &step);
    CHECK(kmp_account_excess(&q, account, 10, &why) == !good);
    if (!good)
        CHECK(strstr(why.s, "quantity 'x' changes too fast") != NULL);
    kmp_text_free(&why);
    kmp_account_values(&q, account, 0, 10, end, values);
    return good;
}

static double fast(double t)
{
    return 0.1 * sin(300 * t);
}

static double growing(double t)
{
    return t * t * cos(900 * t);
}

/* Every turn of a wave within one step is seen. */
static void waves_are_resolved(void)
{
    wave x = {.of = fast}, y = {.of = growing};
    double value[2];
    CHECK(take_of(&x, (kmp_run_quantity){.kind = KMP_TAKE_RANGE}, KMP_ARGUMENT_WAVE, value));
    CHECK_NEAR(value[0], 0.2, 1e-9);
    CHECK(take_of(&x, (kmp_run_quantity){.kind = KMP_TAKE_COUNT}, KMP_ARGUMENT_WAVE, value));
    CHECK(value[0] == 477); /* sin < 0 from each odd multiple of pi on, below 3000 */
    CHECK(take_of(&x, (kmp_run_quantity){.kind = KMP_TAKE_INTEGRAL}, KMP_ARGUMENT_WAVE, value));
    CHECK_NEAR(value[0], 0.1 * (1 - cos(3000)) / 300, 1e-8);
    CHECK(take_of(&y, (kmp_run_quantity){.kind = KMP_TAKE_MAX}, KMP_ARGUMENT_WAVE, value));
    double last = 2 * M_PI * floor(9000 / (2 * M_PI)) / 900; /* the turn is at tan 900 t = 2/(900 t) */
    CHECK_NEAR(value[0], last * last, 1e-4);
    CHECK_NEAR(value[1], last, 1e-5);
}

static double pulse(double t)
{
    return exp(-(t - 5.0123) * (t - 5.0123) / 1e-4);
}

static double pulse_argument(double t)
{
    return -(t - 5.0123) * (t - 5.0123) / 1e-4;
}

static double tip(double t)
{
    return fmax(0, 1 - fabs(t - 5.0123) / 1e-3);
}

static double tip_argument(double t)
{
    return 1 - fabs(t - 5.0123) / 1e-3;
}

/* A pulse between all points at which a step is sampled is found by what its function is taken of. */
static void pulses_are_found(void)
{
    wave x = {.of = pulse, .argument = pulse_argument}, y = {.of = tip, .argument = tip_argument};
    double value[2];
    CHECK(take_of(&x, (kmp_run_quantity){.kind = KMP_TAKE_INTEGRAL}, KMP_ARGUMENT_PEAK, value));
    CHECK_NEAR(value[0], 1e-2 * sqrt(M_PI), 1e-8);
    CHECK(take_of(&x, (kmp_run_quantity){.kind = KMP_TAKE_MAX}, KMP_ARGUMENT_PEAK, value));
    CHECK_NEAR(value[0], 1, 1e-8);
    CHECK_NEAR(value[1], 5.0123, 1e-5);
    CHECK(take_of(&y, (kmp_run_quantity){.kind = KMP_TAKE_MAX}, KMP_ARGUMENT_KINK, value));
    CHECK_NEAR(value[0], 1, 1e-6);
    CHECK(take_of(&y, (kmp_run_quantity){.kind = KMP_TAKE_INTEGRAL}, KMP_ARGUMENT_KINK, value));
    CHECK_NEAR(value[0], 1e-3, 1e-6);
}

static double sizes(double t)
{
    return fabs(sin(300 * t + 3.447));
}

static double sizes_argument(double t)
{
    return sin(300 * t + 3.447);
}

/* Kinks at zeros of an argument are the ends of parts. */
static void kinks_are_ends(void)
{
    wave x = {.of = sizes, .argument = sizes_argument};
    double value[2], last = 3003.447, turns = floor(last / M_PI) - 1;
    CHECK(take_of(&x, (kmp_run_quantity){.kind = KMP_TAKE_INTEGRAL}, KMP_ARGUMENT_SIZE, value));
    double first = 2 * M_PI - 3.447, over = last - M_PI * (turns + 1);
    CHECK_NEAR(value[0], (1 - cos(first) + 2 * (turns - 1) + 1 - cos(over)) / 300, 1e-8);
}

static double jumps(double t)
{
    return t < 3.7 ? 1 : 2;
}

static double rounding(double t)
{
    return fmod(1e15 * (t + 1), 7) > 4 ? 1e-17 : 0;
}

static double too_fast(double t)
{
    return sin(1e8 * t);
}

/* A jump is narrowed to the tolerance of an integral; rounding is not followed; what needs more work than the bound
 * fails by its name. */
static void what_is_not_smooth_ends(void)
{
    wave x = {.of = jumps}, y = {.of = rounding}, z = {.of = too_fast};
    double value[2];
    CHECK(take_of(&x, (kmp_run_quantity){.kind = KMP_TAKE_INTEGRAL}, KMP_ARGUMENT_WAVE, value));
    CHECK_NEAR(value[0], 3.7 + 2 * 6.3, 1e-7);
    CHECK(take_of(&x, (kmp_run_quantity){.kind = KMP_TAKE_MAX}, KMP_ARGUMENT_WAVE, value));
    CHECK(value[0] == 2);
    CHECK(take_of(&y, (kmp_run_quantity){.kind = KMP_TAKE_MAX}, KMP_ARGUMENT_WAVE, value));
    printf("%d states of rounding\n", y.states);
    CHECK(fabs(value[0]) < 1e-16 && y.states < 20000);
    CHECK(!take_of(&z, (kmp_run_quantity){.kind = KMP_TAKE_MAX}, KMP_ARGUMENT_WAVE, value));
}

int main(void)
{
    TEST(halves_share_their_ends);
    TEST(parts_are_the_same);
    TEST(waves_are_resolved);
    TEST(pulses_are_found);
    TEST(kinks_are_ends);
    TEST(what_is_not_smooth_ends);
    return check_report();
}
