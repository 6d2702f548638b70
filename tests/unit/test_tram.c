/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: not_sanitized */
/* The tram, included bogies and all: its counts, the loops of each bogie solved by themselves, what its cranks bear at
 * rest. */
#include "analyses/equilibrium/balances.h"
#include "constraints/diagnosis/diagnosis.h"
#include "loaded.h"
#include "model/data/model.h"
#include <kempe/check.h>
#include <kempe/equilibrium.h>
#include <kempe/settings.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BODIES = 51, COORDINATES = 90, LOOPS = 20, ROWS = 42, WHEELS = 12, MOST_BLOCK = 7 };

static const char file[] = "examples/tram/tram.yaml";

/* 'a', 'b' or 'c': whose coordinates the block has; 0: of several. */
static char bogie_of(const kempe_model *model, const kmp_loop_block *block)
{
    char first = model->motions[block->columns[0]].name[0];
    for (int k = 1; k < block->size; k++)
        if (model->motions[block->columns[k]].name[0] != first)
            return 0;
    return first;
}

static bool is_articulation(const kempe_model *model, const kmp_loop_block *block)
{
    bool all = true;
    for (int k = 0; k < block->closure_count; k++) {
        const char *name = model->closures[block->closures[k]].name;
        all = all && (strcmp(name, "ab") == 0 || strcmp(name, "bc") == 0);
    }
    return all;
}

static bool is_loop_of(const kempe_model *model, const kmp_loop_block *block, char bogie)
{
    for (int k = 0; k < block->closure_count; k++) {
        const char *name = model->closures[block->closures[k]].name;
        if (name[0] != bogie || name[1] != '_')
            return false;
    }
    return true;
}

static void bogies_are_blocks_of_their_own(void)
{
    loaded l = load(file);
    kempe_check *check = NULL;
    CHECK(l.system && kempe_check_new(l.system, &check) == KEMPE_OK);
    if (check) {
        const kmp_diagnosis *d = &check->diagnosis;
        int columns = 0, inside = 0;
        CHECK(l.model->body_count == 1 + BODIES && l.model->motion_count == COORDINATES); /* the ground is one */
        CHECK(l.model->wheel_count == WHEELS);
        CHECK(l.model->closure_count == LOOPS && check->part.r == ROWS && check->part.p == COORDINATES - ROWS);
        for (int b = 0; b < d->block_count; b++) {
            const kmp_loop_block *block = &d->blocks[b];
            char bogie = bogie_of(l.model, block);
            bool own = bogie && is_loop_of(l.model, block, bogie);
            columns += block->size;
            inside += own ? block->size : 0;
            CHECK(own || is_articulation(l.model, block));
            CHECK(block->size <= MOST_BLOCK);
        }
        CHECK(columns == ROWS && inside == ROWS - 2 * 3);
    }
    kempe_check_free(check);
    unload(&l);
}

static double multiplier(const kempe_system *system, const kempe_equilibrium *e, const char *row)
{
    for (int k = 0; k < kempe_system_row_count(system); k++)
        if (strcmp(kempe_system_row_name(system, k), row) == 0)
            return e->balance[0].lambda[k];
    return NAN;
}

/* Two upright rods bear the car, the traverse, the cradle and half of the link L3. They stand 0.165 m before the pivot,
 * and L3, 0.15 m below it, pulls against that; as far as it leans it pulls down, too. */
static double load_of_a_rod(double car, double leans)
{
    double load = 9.81 * (car + 2833.0 / 3 - 640 + 300 + 15.0 / 2);
    return load / 2 * (1 - 0.165 / 0.15 * leans);
}

/* The equilibrium, or the steady motion, of the tram at a speed. */
static void cranks_bear_the_cars_at(const char *speed)
{
    const kempe_setting set = {"V", speed};
    static const double car[] = {8500, 5500, 8500};
    loaded l = load_set(file, &set, 1);
    kempe_equilibrium *e = NULL;
    if (l.system && kempe_equilibrium_new(l.system, NULL, &e) != KEMPE_OK)
        printf("%s\n", kempe_context_message(l.context));
    CHECK(e && e->balance[0].residual < 1e-10);
    for (int k = 0; e && k < 3; k++) {
        char name[16];
        (void)snprintf(name, sizeof name, "%c_L3_pitch", 'a' + k);
        double wanted = load_of_a_rod(car[k], e->balance[0].q[coordinate_named(&l, name)]);
        for (int rod = 1; rod <= 2; rod++) {
            (void)snprintf(name, sizeof name, "%c_K%d.1", 'a' + k, rod);
            /* h is half the difference of squares: lambda times the rod's length is its force */
            double found = 0.18 * fabs(multiplier(l.system, e, name));
            printf("   %s %.3f N, by statics %.3f N\n", name, found, wanted);
            CHECK(fabs(found / wanted - 1) < 2e-5);
        }
    }
    for (int k = 0; e && k < e->freed_count; k++) {
        const char *name = e->freed_name[k];
        double radius = strstr(name, "_x") ? 1 : strstr(name, "_F") ? 0.32 : 0.1875;
        CHECK(fabs(e->balance[0].freed[k] * radius / strtod(speed, NULL) - 1) < 2e-3);
    }
    CHECK(e && e->freed_count == (strtod(speed, NULL) > 0 ? 13 : 0));
    kempe_equilibrium_free(e);
    unload(&l);
}

static void cranks_bear_the_cars(void)
{
    cranks_bear_the_cars_at("0");
}

/* Without a word about rates: the way and all twelve wheels go on, as fast as the motors want it, and the cranks bear
 * what they bear at rest. */
static void it_rolls_at_its_own_speed(void)
{
    cranks_bear_the_cars_at("10");
    cranks_bear_the_cars_at("15");
}

int main(void)
{
    TEST(bogies_are_blocks_of_their_own);
    TEST(cranks_bear_the_cars);
    TEST(it_rolls_at_its_own_speed);
    return check_report();
}
