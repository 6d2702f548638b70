/* SPDX-License-Identifier: BSD-3-Clause */
/* Minima with some pairs of entries in discs: the conditions of a minimum of a convex function, which suffice, and a
 * pair whose minimum is known. */
#include "linalg/dense/disc_minimum.h"
#include "random.h"
#include "testing.h"

#include <math.h>
#include <stdbool.h>

enum { MOST = 8, ROOM = 4 * MOST * MOST + 28 * MOST };

typedef struct problem {
    int n, partner[MOST];
    double d[MOST * MOST], a[MOST], lower[MOST], upper[MOST];
} problem;

static double slope(const problem *p, const double *x, int i)
{
    double sum = p->a[i];
    for (int j = 0; j < p->n; j++)
        sum += p->d[i + j * p->n] * x[j];
    return sum;
}

/* Pairs of equal radius first, then entries of their own, some of them with one bound at infinity. */
static void randomise(problem *p, int pairs, int others, int rank)
{
    double g[MOST][MOST];
    p->n = 2 * pairs + others;
    for (int i = 0; i < p->n; i++) {
        bool second = i < 2 * pairs && i % 2 == 1;
        p->partner[i] = i >= 2 * pairs ? -1 : second ? i - 1 : i + 1;
        for (int k = 0; k < rank; k++)
            g[i][k] = between(-1, 1);
        p->a[i] = 0;
        for (int k = 0; k < rank; k++) /* within the range of D: it has a minimum */
            p->a[i] += 3 * g[i][k] * cos(k + 1.0);
        p->upper[i] = second ? p->upper[i - 1] : between(0, 2);
        p->lower[i] = -p->upper[i];
        if (i >= 2 * pairs && pick(2)) {
            p->lower[i] = 0;
            p->upper[i] = INFINITY;
        }
    }
    for (int i = 0; i < p->n; i++)
        for (int j = 0; j < p->n; j++) {
            p->d[i + j * p->n] = 0;
            for (int k = 0; k < rank; k++)
                p->d[i + j * p->n] += g[i][k] * g[j][k];
        }
}

static void check_pair(const problem *p, const double *x, const double *y, const int *side, int i)
{
    double size = hypot(x[i], x[i + 1]), radius = p->upper[i], off = hypot(slope(p, x, i), slope(p, x, i + 1));
    CHECK(size <= radius * (1 + 1e-13));
    CHECK(side[i] == side[i + 1] && (side[i] == 0 || side[i] == 1));
    if (side[i] == 0) {
        CHECK(off < 1e-9 && y[i] == 0 && y[i + 1] == 0);
        return;
    }
    CHECK_NEAR(size, radius, 1e-13);
    CHECK(fabs(x[i] * y[i + 1] - x[i + 1] * y[i]) <= 1e-9 * radius);
    CHECK(x[i] * y[i] + x[i + 1] * y[i + 1] <= 1e-9 * radius);
}

static void conditions_hold(void)
{
    double x[MOST], y[MOST], room[ROOM];
    int side[MOST];
    random_seed(11);
    for (int k = 0; k < 400; k++) {
        problem p;
        int pairs = 1 + pick(3), others = pick(MOST - 2 * pairs + 1);
        randomise(&p, pairs, others, 1 + pick(2 * pairs + others));
        const kmp_box box = {p.n, p.d, p.a, p.lower, p.upper};
        for (int i = 0; i < p.n; i++)
            x[i] = 0;
        CHECK(kmp_disc_minimum(&box, p.partner, x, y, side, room) == KMP_BOX_FOUND);
        for (int i = 0; i < p.n; i++) {
            if (p.partner[i] > i)
                check_pair(&p, x, y, side, i);
            if (p.partner[i] >= 0)
                continue;
            CHECK(x[i] >= p.lower[i] && x[i] <= p.upper[i]);
            CHECK(side[i] != 0 || fabs(slope(&p, x, i)) < 1e-9);
            CHECK(side[i] * y[i] <= 1e-9);
        }
    }
}

/* Pairs that rounding keeps from their circle by more than a few last digits: where it meets the square of its bounds,
 * the minimum in the square keeps to these; where D is nearly singular, |x| has lost digits. Numbers of an impact and
 * of a contact of a rod's tip; x[2] by the root of |x(s)| = R with 40 digits. */
static void near_the_circle(void)
{
    static const struct {
        double d[9], a[3], radius, x2;
    } cases[] = {
        {{64.608317010534989, 16.155091078576124, 0.0012606021991487025, 16.155091078576124, 4.1239454285479074,
          -0.0039969263133684818, 0.0012606021991487025, -0.0039969263133684818, 42.268808855082206},
         {-0.031048325089267824, -7.5400958566368848e-05, -1.4072372577542646e-06},
         0.00019222494270640175,
         -3.341540010668487e-10},
        {{64.455664213923455, 16.374766257743122, 8.8456484410657523e-05, 16.374766257743122, 4.2595816383554732,
          -0.00028478084290002641, 8.8456484410657523e-05, -0.00028478084290002641, 42.231287736122098},
         {-36.961049900608984, -9.3816309993091789, -7.0856079822043561e-05},
         0.029040568331262496,
         2.642815052675030e-07}};
    for (int k = 0; k < 2; k++) {
        const double radius = cases[k].radius;
        problem p = {
            .n = 3, .partner = {-1, 2, 1}, .lower = {0, -radius, -radius}, .upper = {INFINITY, radius, radius}};
        memcpy(p.d, cases[k].d, sizeof cases[k].d);
        memcpy(p.a, cases[k].a, sizeof cases[k].a);
        double x[3] = {0}, y[3], room[ROOM];
        int side[3];
        const kmp_box box = {p.n, p.d, p.a, p.lower, p.upper};
        CHECK(kmp_disc_minimum(&box, p.partner, x, y, side, room) == KMP_BOX_FOUND);
        check_pair(&p, x, y, side, 1);
        CHECK(side[1] == 1 && fabs(x[2] / cases[k].x2 - 1) < 1e-9);
    }
}

/* Problems that share nothing, their entries mixed: each has the minimum that it has alone, to the last bit. */
static void groups(void)
{
    enum { COUNT = 3, EACH = 4, ALL = COUNT * EACH };
    double x[ALL], y[ALL], d[ALL * ALL], a[ALL], lower[ALL], upper[ALL];
    double room[4 * ALL * ALL + 28 * ALL];
    int side[ALL], partner[ALL];
    CHECK(sizeof room / sizeof *room >= (size_t)kmp_disc_room(ALL));
    random_seed(17);
    for (int k = 0; k < 200; k++) {
        problem p[COUNT];
        memset(d, 0, sizeof d);
        for (int g = 0; g < COUNT; g++) {
            randomise(&p[g], 1, EACH - 2, 1 + pick(EACH));
            for (int i = 0; i < EACH; i++) {
                const int at = COUNT * i + g;
                a[at] = p[g].a[i];
                lower[at] = p[g].lower[i];
                upper[at] = p[g].upper[i];
                partner[at] = p[g].partner[i] < 0 ? -1 : COUNT * p[g].partner[i] + g;
                x[at] = 0;
                for (int j = 0; j < EACH; j++)
                    d[at + (COUNT * j + g) * ALL] = p[g].d[i + j * EACH];
            }
        }
        const kmp_box all = {ALL, d, a, lower, upper};
        CHECK(kmp_disc_minimum(&all, partner, x, y, side, room) == KMP_BOX_FOUND);
        for (int g = 0; g < COUNT; g++) {
            double own_x[EACH] = {0}, own_y[EACH];
            int own_side[EACH];
            const kmp_box own = {EACH, p[g].d, p[g].a, p[g].lower, p[g].upper};
            CHECK(kmp_disc_minimum(&own, p[g].partner, own_x, own_y, own_side, room) == KMP_BOX_FOUND);
            for (int i = 0; i < EACH; i++) {
                const int at = COUNT * i + g;
                CHECK(x[at] == own_x[i] && y[at] == own_y[i] && side[at] == own_side[i]);
            }
        }
    }
}

/* An isotropic pair: the force is opposite to the load. One that is fixed stays where it is. */
static void a_known_pair(void)
{
    const double d[] = {2, 0, 0, 2}, a[] = {3, -4}, lower[] = {-1, -1}, upper[] = {1, 1}, fixed[] = {0.5, -0.25};
    double x[2] = {0}, y[2], room[ROOM];
    const int partner[] = {1, 0};
    int side[2];
    CHECK(kmp_disc_minimum(&(kmp_box){2, d, a, lower, upper}, partner, x, y, side, room) == KMP_BOX_FOUND);
    CHECK_NEAR(x[0], -0.6, 1e-15);
    CHECK_NEAR(x[1], 0.8, 1e-15);
    CHECK_NEAR(y[0], 1.8, 1e-14);
    CHECK(kmp_disc_minimum(&(kmp_box){2, d, a, fixed, fixed}, partner, x, y, side, room) == KMP_BOX_FOUND);
    CHECK(x[0] == 0.5 && x[1] == -0.25);
}

int main(void)
{
    TEST(conditions_hold);
    TEST(near_the_circle);
    TEST(groups);
    TEST(a_known_pair);
    return check_report();
}
