/* SPDX-License-Identifier: BSD-3-Clause */
/* The bogie of examples/bogie: what it is, its closed positions against digits that are not Kempe's, and a motion with
 * the coordinates that an engineer would call independent. */
#include "constraints/diagnosis/diagnosis.h"
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/workspace.h>
#include <math.h>
#include <stdlib.h>

enum { N = 24, ROWS = 12, FREE = 12 };

static const char model[] = "examples/bogie/bogie.yaml";

/* -- what it is -------------------------------------------------------------------------------------- */

static void counts(void)
{
    loaded l = load(model);
    kempe_check *check = NULL;
    char *text = NULL;
    CHECK(kempe_check_new(l.system, &check) == KEMPE_OK);
    CHECK(check->body_count == 13 && check->loop_count == 6);
    CHECK(check->part.n == N && check->part.m == ROWS && check->part.r == ROWS && check->part.p == FREE);
    CHECK(kempe_check_print(check, KEMPE_TEXT, &text) == KEMPE_OK && strstr(text, "12 equations in 6 closures"));
    for (int i = 0; i < N; i++)
        CHECK(fabs(kempe_assembly_q(check->assembly)[i]) <= 1e-15); /* closed as drawn */
    kempe_text_free(text);
    kempe_check_free(check);
    unload(&l);
}

/* -- closed positions -------------------------------------------------------------------------------- */

static const char *const free_names[FREE] = {"x",       "y",       "z",       "yaw",     "roll", "pitch",
                                             "spin_FL", "spin_FR", "spin_RL", "spin_RR", "warp", "stroke"};

static void hold_free(const loaded *l, int hold[N])
{
    memset(hold, 0, N * sizeof *hold);
    for (int k = 0; k < FREE; k++)
        hold[coordinate_named(l, free_names[k])] = 1;
}

enum { MOST_COLUMNS = 16 };

static char *next_line(char *line, int size, FILE *f)
{
    do
        line = fgets(line, size, f);
    while (line && line[0] == '#');
    return line;
}

/* examples/bogie/closures.csv: its digits come from kinematics of their own. All that is not in it stays at zero. */
static void positions_of_the_table(void)
{
    loaded l = load(model);
    kempe_workspace *ws = NULL;
    char line[1024];
    int at[MOST_COLUMNS], columns = 0, rows = 0, hold[N];
    double worst = 0;
    FILE *f = fopen(KEMPE_ROOT "/examples/bogie/closures.csv", "r");
    CHECK(f && kempe_workspace_new(l.system, &ws) == KEMPE_OK && next_line(line, sizeof line, f));
    for (char *name = strtok(line, ",\n"); name && columns < MOST_COLUMNS; name = strtok(NULL, ",\n"))
        at[columns++] = coordinate_named(&l, name);
    hold_free(&l, hold);
    while (next_line(line, sizeof line, f)) {
        double q[N] = {0}, expected[N] = {0};
        char *rest = line;
        for (int k = 0; k < columns; k++, rest++)
            expected[at[k]] = strtod(rest, &rest);
        for (int i = 0; i < N; i++)
            q[i] = hold[i] ? expected[i] : 0;
        CHECK(kempe_workspace_close(ws, 0, q, NULL, hold) == KEMPE_OK);
        for (int i = 0; i < N; i++)
            worst = check_max(worst, fabs(q[i] - expected[i]));
        rows++;
    }
    printf("   %d positions, off by %.1e\n", rows, worst);
    CHECK(rows == 5 && columns == 14 && worst <= 1e-12);
    (void)fclose(f);
    kempe_workspace_free(ws);
    unload(&l);
}

/* -- motions ----------------------------------------------------------------------------------------- */

static void run(const loaded *l, const char *u, double q[N])
{
    kempe_run_options spec = {0};
    kempe_trajectory *motion = NULL;
    spec.t_end = 0.1;
    spec.rtol = 1e-11;
    spec.independent = u;
    spec.keep_independent = u != NULL;
    spec.no_convergence_check = 1;
    CHECK(kempe_simulate(l->system, &spec, &motion) == KEMPE_OK);
    memcpy(q, kempe_trajectory_q(motion, kempe_trajectory_row_count(motion) - 1), N * sizeof *q);
    kempe_trajectory_free(motion);
}

/* Warp and stroke instead of the cranks that Kempe takes: the same motion. */
static void warp_and_stroke_may_be_independent(void)
{
    loaded l = load("examples/bogie/shake.yaml");
    double chosen[N], requested[N], worst = 0;
    run(&l, NULL, chosen);
    run(&l, "x,y,z,yaw,roll,pitch,spin_FL,spin_FR,spin_RL,spin_RR,warp,stroke", requested);
    for (int i = 0; i < N; i++)
        worst = check_max(worst, fabs(chosen[i] - requested[i]));
    printf("   off by %.1e\n", worst);
    CHECK(worst <= 1e-9 && fabs(chosen[coordinate_named(&l, "warp")]) > 0.01);
    unload(&l);
}

int main(void)
{
    TEST(counts);
    TEST(positions_of_the_table);
    TEST(warp_and_stroke_may_be_independent);
    return check_report();
}
