/* SPDX-License-Identifier: BSD-3-Clause */
/* Generated equations with friction that sticks, in a program with an integrator and a choice of modes of its own
 * (belt_loop.c): a block on a belt, whose transitions are closed forms. */
#include "generate/compiled_equations.h"
#include <math.h>

/* Runge-Kutta steps of order 4 of 1e-3 s for 50 s are right to some 1e-11. */
#define ALLOWED 1e-9

static bool emit_belt(void)
{
    const kempe_generate_options g = {.sets = "M_C+h_J+jdqd,friction", .drives = 1, .language = "c"};
    kempe_model *model = NULL;
    CHECK(kempe_model_read(context, KEMPE_ROOT "/tests/models/friction_belt.yaml", &model) == KEMPE_OK);
    bool ok = model && emit(model, &g);
    kempe_model_free(model);
    return ok;
}

static FILE *start_loop(void)
{
    char command[1024];
    snprintf(command, sizeof command,
             "cd %s && %s -std=c99 -O1 -Wall -Wextra -Wpedantic -Werror -I. -o loop %s/tests/generate/belt_loop.c "
             "friction_belt.c -lm",
             folder, KEMPE_CC, KEMPE_ROOT);
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
    FILE *pipe = emit_belt() ? start_loop() : NULL;
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

int main(void)
{
    context = kempe_context_new();
    if (!mkdtemp(folder))
        return 1;
    TEST(transitions);
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(runs(command));
    kempe_context_free(context);
    return check_report();
}
