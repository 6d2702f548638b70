/* SPDX-License-Identifier: BSD-3-Clause */
/* Generated equations in programs with integrators of their own, which need nothing of Kempe: friction that sticks,
 * with a choice of modes (belt_loop.c), whose transitions are closed forms; states with samples and events
 * (sampled_loop.c). */
#include "generate/compiled_equations.h"
#include <math.h>

/* Runge-Kutta steps of order 4 of 1e-3 s for 50 s are right to some 1e-11. */
#define ALLOWED 1e-9

static bool write_equations(const char *name, const char *sets)
{
    const kempe_generate_options g = {.sets = sets, .drives = 1, .language = "c"};
    kempe_model *model = NULL;
    char path[1024];
    snprintf(path, sizeof path, "%s/tests/models/%s.yaml", KEMPE_ROOT, name);
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
    bool ok = model && emit(model, &g);
    kempe_model_free(model);
    return ok;
}

static FILE *start_loop(const char *program, const char *name)
{
    char command[1024];
    snprintf(command, sizeof command,
             "cd %s && %s -std=c99 -O1 -Wall -Wextra -Wpedantic -Werror -I. -o loop %s/tests/generate/%s %s.c -lm",
             folder, KEMPE_CC, KEMPE_ROOT, program, name);
    if (!runs(command))
        return NULL;
    snprintf(command, sizeof command, "%s/loop", folder);
    return popen(command, "r");
}

/* Mass 1 and spring 1 on a belt of 0.2 m/s: friction 0.6 in slip, 1 in stick. The block slips until it has the rate of
 * the belt, sticks until the spring is 1, and slips in the half circle of x'' = 0.6 - x around 0.6 back to 0.2. */
static void transitions(void)
{
    const double pi = acos(-1), slips = 2 * (pi - atan(2));
    double t = asin(1 / 3.0), x = 0.6 * (1 - sqrt(8) / 3);
    int count = 0, mode;
    double at, place;
    FILE *pipe =
        write_equations("friction_belt", "M_C+h_J+jdqd,friction") ? start_loop("belt_loop.c", "friction_belt") : NULL;
    CHECK(pipe != NULL);
    while (pipe && fscanf(pipe, "%lf %lf %d", &at, &place, &mode) == 3) {
        CHECK_NEAR(at, t, ALLOWED);
        CHECK_NEAR(place, x, ALLOWED);
        CHECK(mode == (count % 2 ? -1 : 0));
        t += count % 2 ? slips : (1 - x) / 0.2;
        x = count % 2 ? 0.2 : 1;
        count++;
    }
    CHECK(pipe && pclose(pipe) == 0);
    CHECK(count == 13);
}

/* x'' = u - a x' with u = -30 (x - 1) - 4 x' at each sample of 0.05; the times at which x passes 0.9 from below. */
static void samples_and_events(void)
{
    const double a = 0.2, every = 0.05, end = 2.03;
    double x = 0.1, v = 0, u = 0, passes = 0, got_x = NAN, got_v = NAN, got_u = NAN, got_passes = NAN, t;
    for (int k = 0; k * every < end; k++) {
        u = -30 * (x - 1) - 4 * v;
        for (int part = 0; part < 50 && k * every + part * every / 50 < end - 1e-9; part++) {
            double h = every / 50, decay = exp(-a * h), drift = (1 - decay) / a, before = x;
            x += v * drift + u / a * (h - drift);
            v = v * decay + u * drift;
            passes += x > 0.9 && before <= 0.9;
        }
    }
    FILE *pipe =
        write_equations("sampled_slide", "M_C,discrete") ? start_loop("sampled_loop.c", "sampled_slide") : NULL;
    CHECK(pipe && fscanf(pipe, "%lf %lf %lf %lf %lf", &t, &got_x, &got_v, &got_u, &got_passes) == 5);
    CHECK(pipe && pclose(pipe) == 0);
    CHECK_NEAR(got_x, x, ALLOWED);
    CHECK_NEAR(got_v, v, ALLOWED);
    CHECK_NEAR(got_u, u, ALLOWED);
    CHECK(passes >= 1 && got_passes == passes);
}

int main(void)
{
    context = kempe_context_new();
    if (!mkdtemp(folder))
        return 1;
    TEST(transitions);
    TEST(samples_and_events);
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(runs(command));
    kempe_context_free(context);
    return check_report();
}
