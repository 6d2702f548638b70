/* SPDX-License-Identifier: BSD-3-Clause */
/* The quick part of the hard battery (bench/hard runs all of it): every case on every road within its bars. Cases known
 * not to reach theirs must still take the right branch. */
#include "bench/battery.h"
#include "check.h"

static void run_roads(const hard_case *c, hard_scene *s)
{
    for (int k = 0; k < HARD_ROADS; k++) {
        hard_result r = hard_run(s, KEMPE_ROOT, c, &hard_roads[k], 0);
        bool passed = r.passed || (c->open && r.status == KEMPE_OK && r.error < 1e-3);
        if (!r.passed)
            printf("  %s on %s/%s: error %.1e, drift %.1e %s\n", c->name, hard_roads[k].road, hard_roads[k].form,
                   r.error, r.drift, r.report.reason ? r.report.reason : "");
        CHECK(passed);
        kmp_free(r.report.reason);
    }
}

static void cases_keep_their_bars(void)
{
    int count = 0;
    for (int k = 0; k < HARD_CASES; k++) {
        const hard_case *c = &hard_cases[k];
        hard_scene s;
        if (c->slow)
            continue;
        CHECK(hard_load(&s, KEMPE_ROOT, c) || c->end == HARD_STOPS);
        if (s.system)
            run_roads(c, &s);
        hard_unload(&s);
        count++;
    }
    printf("  %d cases on %d roads\n", count, HARD_ROADS);
}

/* A slider pushed beyond its reach: the sentence says which coordinate, and when. */
static void a_lock_is_named(void)
{
    const hard_case c = {.name = "lock", .model = "tests/models/locked_slider_crank.yaml", .t_end = 3, .rtol = 1e-8};
    hard_scene s;
    CHECK(hard_load(&s, KEMPE_ROOT, &c));
    for (int k = 0; k < HARD_ROADS; k++) {
        hard_result r = hard_run(&s, KEMPE_ROOT, &c, &hard_roads[k], 0);
        CHECK(r.status == KEMPE_E_FAILED && fabs(r.report.t - 1.5) < 1e-6);
        CHECK(r.report.reason && strstr(r.report.reason, "locks at t = 1.5") && strstr(r.report.reason, "'slider'"));
        kmp_free(r.report.reason);
    }
    hard_unload(&s);
}

/* Rows go bad nine times in a turn; with others the dae road must start from a state that closes those too, and with as
 * many of them as before, or it stops, or swallows the motion. */
static void bennett_turns_on_the_dae_road(void)
{
    static const char *const models[2] = {"tests/models/bennett.yaml", "examples/bennett/bennett.yaml"};
    for (int k = 0; k < 2; k++) {
        hard_case c = {.name = "Bennett", .model = models[k], .rule = hard_bennett, .t_end = 10, .rtol = 1e-8};
        hard_scene s;
        CHECK(hard_load(&s, KEMPE_ROOT, &c));
        for (int i = 0; i <= 20; i++) {
            double rtol = pow(10, -6 - 0.25 * i);
            hard_result r = hard_run(&s, KEMPE_ROOT, &c, &hard_roads[3], rtol);
            CHECK(r.status == KEMPE_OK);
            CHECK(r.error < 1e-5 && r.drift < 1e-3);
            if (r.status != KEMPE_OK || r.error >= 1e-5)
                printf("  rtol %.1e: error %.1e %s\n", rtol, r.error, r.report.reason ? r.report.reason : "");
            kmp_free(r.report.reason);
        }
        hard_unload(&s);
    }
}

int main(void)
{
    TEST(cases_keep_their_bars);
    TEST(a_lock_is_named);
    TEST(bennett_turns_on_the_dae_road);
    return check_report();
}
