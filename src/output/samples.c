/* SPDX-License-Identifier: BSD-3-Clause */
/* The quantities of a state; rows of a run in one array that doubles when it is full; loads at an instant. */
#include "output/samples.h"
#include "base/memory.h"
#include "dynamics/closures.h"
#include "dynamics/equations.h"
#include "dynamics/forces/forces.h"
#include "dynamics/joint_loads.h"
#include "dynamics/kinematics/bearing_forces.h"
#include "dynamics/program_cache.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/tyre.h"
#include "symbolic/program_bytes.h"
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/* -- quantities ------------------------------------------------------------------------------------------ */

const char *kmp_quantity_prefix(kmp_quantity quantity)
{
    static const char *const prefix[] = {"q", "qd", "qdd", "lambda", "state"};
    return prefix[quantity];
}

int kmp_quantity_size(const kempe_system *system, kmp_quantity quantity)
{
    return quantity == KMP_QUANTITY_LAMBDA  ? system->m
           : quantity == KMP_QUANTITY_STATE ? system->model->state_count
                                            : kmp_model_coordinates(system->model);
}

const char *kmp_quantity_name(const kempe_system *system, kmp_quantity quantity, int k)
{
    return quantity == KMP_QUANTITY_LAMBDA  ? system->row_names[k]
           : quantity == KMP_QUANTITY_STATE ? system->model->states[k].name
                                            : system->model->motions[k].name;
}

const char *kmp_quantity_unit(const kempe_system *system, kmp_quantity quantity, int k)
{
    static const char *const rotation[] = {"rad", "rad/s", "rad/s^2"}, *const slide[] = {"m", "m/s", "m/s^2"};
    if (quantity == KMP_QUANTITY_STATE || (quantity != KMP_QUANTITY_LAMBDA && kmp_state_of(system->model, k)))
        return "";
    if (quantity != KMP_QUANTITY_LAMBDA)
        return system->model->motions[k].rotation ? rotation[quantity] : slide[quantity];
    return kmp_multiplier_unit(system->rows[k].length_power);
}

/* -- rows ---------------------------------------------------------------------------------------------- */

void kmp_samples_init(kmp_samples *table, int n, int m)
{
    *table = (kmp_samples){.n = n, .m = m};
}

void kmp_samples_free(kmp_samples *table)
{
    kmp_free(table->t);
    kmp_free(table->work);
    kmp_free(table->from);
    kmp_free(table->shown);
    for (int k = 0; k < KMP_QUANTITIES; k++)
        kmp_free(table->value[k]);
    *table = (kmp_samples){0};
}

static size_t width_of(const kmp_samples *table, int quantity)
{
    return (size_t)(quantity == KMP_QUANTITY_LAMBDA ? table->m : table->n);
}

/* Room for one more row of at least one number; false: no memory. */
static bool grow(double **array, size_t width, int rows)
{
    double *grown = kmp_list_room(*array, (size_t)rows, (width > 0 ? width : 1) * sizeof *grown);
    *array = grown ? grown : *array;
    return grown;
}

bool kmp_samples_extend(kmp_samples *table)
{
    bool ok = grow(&table->t, 1, table->rows) && grow(&table->work, 1, table->rows);
    for (int k = 0; k < KMP_QUANTITIES; k++)
        ok = ok && grow(&table->value[k], width_of(table, k), table->rows);
    if (!ok)
        return false;
    size_t row = (size_t)table->rows++;
    table->t[row] = table->work[row] = NAN;
    for (int k = 0; k < KMP_QUANTITIES; k++)
        for (size_t i = 0; i < width_of(table, k); i++)
            table->value[k][row * width_of(table, k) + i] = NAN;
    return true;
}

int kmp_samples_add(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    kmp_samples *table = user;
    const double *const from[KMP_QUANTITIES] = {q, qd, qdd, lambda};
    if (!kmp_samples_extend(table))
        return -1;
    size_t row = (size_t)table->rows - 1;
    table->t[row] = t;
    table->work[row] = work;
    for (int k = 0; k < KMP_QUANTITIES; k++)
        if (width_of(table, k) > 0)
            memcpy(table->value[k] + row * width_of(table, k), from[k], width_of(table, k) * sizeof(double));
    return 0;
}

double kmp_samples_time(const kmp_samples *table, int row)
{
    return table->t[row];
}

double kmp_samples_instant(const kmp_samples *table, int row)
{
    return table->from ? table->from[row] : table->t[row];
}

double kmp_samples_work(const kmp_samples *table, int row)
{
    return table->work[row];
}

const double *kmp_samples_get(const kmp_samples *table, kmp_quantity quantity, int row)
{
    return table->value[quantity] + (size_t)row * width_of(table, (int)quantity);
}

void kmp_samples_limit(kmp_samples *table, double t_end)
{
    while (table->rows > 0 && table->t[table->rows - 1] > t_end)
        table->rows--;
}

/* -- loads ----------------------------------------------------------------------------------------------- */

int kmp_all_loads_count(const kmp_all_loads *loads, const kempe_model *model)
{
    return KMP_LOAD_VALUES * (model->closure_count + loads->joints + loads->tyres);
}

/* The load of the joint of a body, behind the ones before it. */
static void add_joint(kmp_all_loads *loads, const kmp_tree *tree, int body, kmp_ref *out)
{
    for (int k = 0; k < KMP_LOAD_VALUES; k++)
        out[KMP_LOAD_VALUES * loads->joints + k] = kmp_joint_load(tree, body, k >= 3).x[k % 3];
    loads->joint[loads->joints++] = body;
}

/* The forces of all tyres, behind the joints. */
static void add_tyres(const kmp_all_loads *loads, const kmp_tree *tree, kmp_ref *out)
{
    const kempe_model *model = tree->model;
    kmp_forces forces;
    for (int k = 0; k < loads->tyres; k++) {
        const int of = model->tyres[k].force;
        kmp_forces_init(&forces, tree, 0, &model->forces[of]);
        for (int i = 0; forces.value && i < KMP_LOAD_VALUES; i++)
            out[KMP_LOAD_VALUES * k + i] = forces.value[KMP_FORCE_WIDTH * of + i];
    }
}

/* The forces of bearings, by loads of their joints that are inputs. */
static bool derive_bearings(kmp_all_loads *loads, const kmp_tree *tree, const double *parameters)
{
    const kempe_model *model = tree->model;
    kmp_ref *out = KMP_ARENA_NEW(&loads->arena, kmp_ref, KMP_BEARING_VALUES * model->bearing_count + 1);
    for (int b = 0; out && b < model->bearing_count; b++) {
        kmp_vec load[2];
        for (int k = 0; k < KMP_LOAD_VALUES; k++)
            load[k / 3].x[k % 3] = kmp_input(tree->graph, KMP_IN_MU, (uint32_t)(KMP_LOAD_VALUES * b + k));
        kmp_bearing_forces(tree, &model->bearings[b], load[0], load[1], out + (ptrdiff_t)KMP_BEARING_VALUES * b);
    }
    return out && kmp_formulas_init(&loads->bearings, tree->graph, KMP_BEARING_VALUES * model->bearing_count, out,
                                    kmp_backend_find("tape"), parameters);
}

static kempe_status derive(kmp_all_loads *loads, kmp_equations *eq, const kempe_system *system)
{
    const kempe_model *model = system->model;
    const int closures = KMP_LOAD_VALUES * model->closure_count;
    kmp_ref *out =
        KMP_ARENA_NEW(&loads->arena, kmp_ref, closures + KMP_LOAD_VALUES * (model->body_count + loads->tyres));
    KMP_TRY(kmp_made(system->context, out));
    KMP_TRY(kmp_joint_loads_begin(eq, true));
    for (int k = 0; k < closures; k++)
        out[k] = kmp_closure_load(&eq->tree, k / KMP_LOAD_VALUES, k % KMP_LOAD_VALUES >= 3).x[k % 3];
    for (int b = 1; b < model->body_count; b++)
        if (!kmp_joint_obstacle(model, b) && !model->bodies[b].coupling &&
            kmp_name_find(KMP_NAMED(model, closure), model->bodies[b].joint) < 0)
            add_joint(loads, &eq->tree, b, out + closures);
    kmp_joint_loads_end(eq);
    add_tyres(loads, &eq->tree, out + closures + (ptrdiff_t)KMP_LOAD_VALUES * loads->joints);
    bool ok = kmp_formulas_init(&loads->formulas, eq->graph, kmp_all_loads_count(loads, model), out,
                                kmp_backend_find("tape"), system->parameters);
    ok = ok && (loads->bearing_count == 0 || derive_bearings(loads, &eq->tree, system->parameters));
    return kmp_made(system->context, ok);
}

static const kmp_program_cache_name kept_as = {.what = "joint loads"};

static void keep(const kmp_all_loads *loads, const kempe_system *system)
{
    kmp_bytes bytes = {0};
    kmp_table_pool pool = {0};
    kmp_bytes_put_int(&bytes, loads->joints);
    KMP_BYTES_PUT(&bytes, loads->joint, loads->joints);
    kmp_program_put(&bytes, &pool, loads->formulas.program);
    if (loads->bearing_count > 0)
        kmp_program_put(&bytes, &pool, loads->bearings.program);
    kmp_program_cache_write(system, kept_as, &bytes);
    kmp_table_pool_free(&pool);
    kmp_bytes_free(&bytes);
}

/* Takes what an earlier process has kept. False: there is nothing. */
static bool recall(kmp_all_loads *loads, const kempe_system *system)
{
    const kempe_model *model = system->model;
    kmp_cached file = kmp_program_cache_recall(system, kept_as);
    kmp_byte_source source = kmp_byte_source_of(file.bytes, file.size);
    kmp_table_pool pool = {0};
    if (!file.whole)
        return false;
    loads->joints = kmp_bytes_take_int(&source, 0, model->body_count - 1);
    KMP_BYTES_TAKE(&source, loads->joint, loads->joints);
    for (int k = 0; k < loads->joints; k++)
        source.failed = source.failed || loads->joint[k] < 1 || loads->joint[k] >= model->body_count;
    loads->formulas.program = kmp_program_get(&source, &pool);
    if (loads->bearing_count > 0)
        loads->bearings.program = kmp_program_get(&source, &pool);
    kmp_table_pool_free(&pool);
    kmp_free(file.whole);
    if (!source.failed && source.at == source.end)
        return true;
    kmp_formulas_free(&loads->formulas);
    kmp_formulas_free(&loads->bearings);
    loads->joints = 0;
    return false;
}

/* The programs that an earlier process has kept. */
static bool prepare(kmp_all_loads *loads, const kempe_system *system)
{
    const kmp_backend *tape = kmp_backend_find("tape");
    return kmp_formulas_prepare(&loads->formulas, tape, system->parameters) &&
           (loads->bearing_count == 0 || kmp_formulas_prepare(&loads->bearings, tape, system->parameters));
}

/* Multipliers have the numbers of the system, which has the rows of friction and contacts. */
static kempe_status make(kmp_all_loads *loads, const kempe_system *system)
{
    const kmp_derivation_request request = {.sets = KMP_SET_REACTION, .plain = true, .keep_modes = true};
    kmp_equations eq;
    KMP_TRY(kmp_equations_derive_once(&eq, system->model, &request));
    kempe_status status = derive(loads, &eq, system);
    kmp_equations_free(&eq);
    KMP_TRY(status);
    if (system->has_key)
        keep(loads, system);
    return KEMPE_OK;
}

static kempe_status begin(kmp_all_loads *loads, const kempe_system *system)
{
    const kempe_model *model = system->model;
    *loads = (kmp_all_loads){.bearing_count = model->bearing_count, .tyres = model->tyre_count};
    loads->joint = KMP_ARENA_NEW(&loads->arena, int, model->body_count);
    loads->bearing = KMP_ARENA_NEW(&loads->arena, int, model->bearing_count + 1);
    loads->carried = KMP_ARENA_NEW(&loads->arena, double, KMP_LOAD_VALUES * model->bearing_count + 1);
    KMP_TRY(kmp_made(system->context, !loads->arena.failed));
    if (system->has_key && recall(loads, system))
        KMP_TRY(kmp_made(system->context, prepare(loads, system)));
    else
        KMP_TRY(make(loads, system));
    for (int b = 0; b < loads->bearing_count; b++) {
        loads->bearing[b] = model->bearings[b].closure;
        for (int k = 0; k < loads->joints && model->bearings[b].closure < 0; k++)
            if (loads->joint[k] == model->bearings[b].body)
                loads->bearing[b] = model->closure_count + k;
    }
    return KEMPE_OK;
}

void kmp_all_loads_free(kmp_all_loads *loads)
{
    kmp_formulas_free(&loads->formulas);
    kmp_formulas_free(&loads->bearings);
    kmp_arena_free(&loads->arena);
}

kempe_status kmp_all_loads_init(kmp_all_loads *loads, const kempe_system *system)
{
    const kempe_status status = begin(loads, system);
    if (status != KEMPE_OK) {
        kmp_all_loads_free(loads);
        *loads = (kmp_all_loads){0};
    }
    return status;
}

const double *kmp_all_loads_at(kmp_all_loads *loads, const kmp_instant *at)
{
    return kmp_formulas_at(&loads->formulas, at);
}

const double *kmp_all_loads_bearings(kmp_all_loads *loads, const kmp_instant *at, const double *values)
{
    kmp_instant here = *at;
    for (int b = 0; b < loads->bearing_count; b++)
        for (int k = 0; k < KMP_LOAD_VALUES; k++)
            loads->carried[KMP_LOAD_VALUES * b + k] =
                loads->bearing[b] < 0 ? NAN : values[KMP_LOAD_VALUES * loads->bearing[b] + k];
    here.mu = loads->carried;
    return kmp_formulas_at(&loads->bearings, &here);
}
