/* SPDX-License-Identifier: BSD-3-Clause */
/* Extremes of outputs over a limit cycle that is a circle, q = R cos(t): at jumps, at corners, and of smooth outputs.
 */
#include "loaded.h"
#include <kempe/limit_cycles.h>
#include <math.h>
#include <string.h>

static const char model[] = "kempe: 1\n"
                            "parameters: {a: 0.1}\n"
                            "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                            "forces: {f: {joint: x, force: \"(a - q(x)^2 - qd(x)^2)*qd(x) - q(x)\"}}\n"
                            "sensors:\n"
                            "  jump: if(q(x) > 0.3, qd(x), 0)\n"
                            "  corner: abs(q(x))\n"
                            "  edge: if(q(x) > 0.3, q(x) - 2*qd(x), 0)\n"
                            "  smooth: q(x)*qd(x)\n";

static double last(const kempe_table *table, const char *column)
{
    for (int k = 0; k < kempe_table_column_count(table); k++)
        if (strcmp(kempe_table_column_name(table, k), column) == 0)
            return kempe_table_values(table, k)[kempe_table_row_count(table) - 1];
    printf("no column %s\n", column);
    return NAN;
}

static void corners_and_jumps(void)
{
    loaded l = load_text(model);
    const double a = 0.5, R = sqrt(a), v = sqrt(a - 0.09);
    const kempe_limit_cycles_options ask = {.sweep = "a=-0.1:0.5:3", .outputs = "jump,corner,edge,smooth"};
    kempe_limit_cycles *cycles = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_limit_cycles_new(l.system, &ask, &cycles) == KEMPE_OK);
    CHECK(cycles && kempe_limit_cycles_table(cycles, "rows", &table) == KEMPE_OK);
    if (table) {
        CHECK_NEAR(last(table, "a"), a, 1e-9);
        CHECK_NEAR(last(table, "sensor.jump.max"), v, 1e-5);
        CHECK_NEAR(last(table, "sensor.jump.min"), -v, 1e-5);
        CHECK_NEAR(last(table, "sensor.corner.max"), R, 1e-6);
        CHECK_NEAR(last(table, "sensor.corner.min"), 0, 1e-5);
        CHECK_NEAR(last(table, "sensor.edge.max"), sqrt(5) * R, 1e-6);
        CHECK_NEAR(last(table, "sensor.edge.min"), 0.3 - 2 * v, 1e-5);
        CHECK_NEAR(last(table, "sensor.smooth.max"), a / 2, 1e-6);
        CHECK_NEAR(last(table, "sensor.smooth.min"), -a / 2, 1e-6);
    }
    kempe_table_free(table);
    kempe_limit_cycles_free(cycles);
    unload(&l);
}

int main(void)
{
    TEST(corners_and_jumps);
    return check_report();
}
