/* SPDX-License-Identifier: BSD-3-Clause */
/* Andrews' squeezing mechanism through the public API: simulate 0.03 s, print the seven angles beside the
 * reference, and fail when they differ by more than 1e-8.
 *
 *     example_andrews [examples/andrews/andrews.yaml]
 */
#include <kempe/kempe.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* At t = 0.03 s, computed in 113-bit arithmetic: see README.md. */
static const struct angle {
    const char *name;
    double value;
} reference[] = {
    {"beta", 15.810771195153707},    {"theta", -15.756371058411839}, {"gamma", 0.040822240119645805},
    {"Phi", -0.53473011634207959},   {"delta", 0.52440996587995407}, {"Omega", 0.53473011634207959},
    {"epsilon", 1.0480807410419379},
};

enum { ANGLES = sizeof reference / sizeof *reference };

static int find(const kempe_model *model, const char *name)
{
    for (int k = 0; k < kempe_model_coordinate_count(model); k++)
        if (strcmp(kempe_model_coordinate_name(model, k), name) == 0)
            return k;
    return -1;
}

/* Prints the comparison and returns the largest error. */
static double compare(const kempe_model *model, const kempe_trajectory *trajectory)
{
    int last = kempe_trajectory_row_count(trajectory) - 1;
    const double *q = kempe_trajectory_q(trajectory, last);
    double worst = 0;
    printf("t = %g s\n%-10s%22s%22s%10s\n", kempe_trajectory_time(trajectory, last), "angle", "computed, rad",
           "reference, rad", "error");
    for (int k = 0; k < ANGLES; k++) {
        int index = find(model, reference[k].name);
        double value = index < 0 ? NAN : q[index], error = fabs(value - reference[k].value);
        printf("%-10s%22.15g%22.15g%10.1e\n", reference[k].name, value, reference[k].value, error);
        worst = error <= worst ? worst : error; /* a NaN is the worst */
    }
    return worst;
}

static kempe_status run(kempe_context *context, const char *path, double *worst)
{
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_run_options settings = {0};
    settings.t_end = 0.03;
    settings.rtol = 1e-11;

    kempe_status status = kempe_model_read(context, path, &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    if (status == KEMPE_OK)
        status = kempe_simulate(system, &settings, &trajectory);
    if (status == KEMPE_OK)
        *worst = compare(model, trajectory);

    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

int main(int argc, char **argv)
{
    kempe_context *context = kempe_context_new();
    if (!context)
        return 1;
    double worst = NAN;
    kempe_status status = run(context, argc > 1 ? argv[1] : "examples/andrews/andrews.yaml", &worst);
    if (status != KEMPE_OK)
        fprintf(stderr, "%s\n", kempe_context_message(context));
    else
        printf("largest error %.1e: %s\n", worst, worst < 1e-8 ? "agrees" : "DOES NOT AGREE");
    kempe_context_free(context);
    return worst < 1e-8 ? 0 : 1;
}
