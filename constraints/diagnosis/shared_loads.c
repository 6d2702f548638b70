/* SPDX-License-Identifier: BSD-3-Clause */
/* Multipliers z of all declared rows with A z = 0, where A has the generalized forces of unit loads: a closure between
 * points loads its second body by forces and moments along the directions of its rows, the first by the opposite ones;
 * other rows are rows of J. The force of a curve is the least one with the generalized forces of its row. The load
 * that a joint of the tree carries balances the loads on all bodies beyond it.
 *
 * Masses load them if random accelerations and gravity do so in only the tree, where rows that no coordinate moves
 * carry nothing. */
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/closing/random_walk.h"
#include "constraints/kinds/kind.h"
#include "dynamics/kinematics/gear_mesh.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/lapack.h"
#include "linalg/sparse.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/data/pose.h"
#include "model/language/expression_value.h"
#include "model/read/loads.h"
#include <math.h>
#include <string.h>

#define ZERO  1e-9 /* pivots of A over the largest */
#define PART  1e-7 /* components of self-balanced loads: smaller ones are rounding */
#define EMPTY 1e-12

const char *const kmp_load_words[KMP_LOAD_SIZE] = {"x", "y", "z", "mx", "my", "mz"};

/* A unit load of a closure on its second body at its point; or a row of J. */
typedef struct column {
    int closure, row; /* row: -1 for a load */
    bool empty;       /* no coordinate moves it */
    double load[KMP_LOAD_SIZE];
    double place[3]; /* of gears: the pitch point, ground axes */
} column;

typedef struct search {
    const kempe_system *s;
    const kempe_model *model;
    const double *q;
    kmp_pose *poses;                /* at q */
    double (*axis)[3], (*place)[3]; /* of motions, ground axes */
    column *columns;
    int n, count;
    double *curve;          /* 4 n */
    const double *jacobian; /* entries of the system's pattern */
    double *work, *z;       /* n: of a column, or of coordinates; count */
    int *start, *entry_row; /* A by columns: count + 1 */
    double *entry;
    int *r, *c, *place_of_row; /* pivots, from the largest: n, count; n */
    double *pivots;
    double (*on_body)[KMP_LOAD_SIZE]; /* of body_count: about the origin of the ground */
    kmp_shared_loads *found;
    int joints, sets; /* of loads of least norm */
    const int *joint;
    double *set; /* KMP_LOAD_SIZE (closures + joints) of each set; NULL: not requested */
    int unknown; /* a closure of a set whose loads on bodies are not known; -1: none */
} search;

static void point_place(const search *x, int point, double out[3])
{
    kmp_pose at;
    kmp_pose_of_point(x->model, x->poses, x->q, point, &at);
    memcpy(out, at.p, sizeof at.p);
}

static void turned(double r[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = kmp_dot(3, r[i], v);
}

/* -- unit loads -------------------------------------------------------------------------------------- */

static void add_load(search *x, int closure, bool moment, const double direction[3])
{
    column *c = &x->columns[x->count++];
    double size = sqrt(kmp_dot(3, direction, direction));
    *c = (column){.closure = closure, .row = -1};
    for (int i = 0; i < 3; i++)
        c->load[i + 3 * moment] = size > 0 ? direction[i] / size : 0;
}

static void add_across(search *x, int closure, bool moment, const double e[3])
{
    int least = fabs(e[0]) <= fabs(e[1]) && fabs(e[0]) <= fabs(e[2]) ? 0 : fabs(e[1]) <= fabs(e[2]) ? 1 : 2;
    double unit[3] = {least == 0, least == 1, least == 2}, a[3], b[3];
    kmp_cross3(e, unit, a);
    kmp_cross3(e, a, b);
    add_load(x, closure, moment, a);
    add_load(x, closure, moment, b);
}

static void add_all(search *x, int closure, bool moment)
{
    for (int i = 0; i < 3; i++) {
        double unit[3] = {i == 0, i == 1, i == 2};
        add_load(x, closure, moment, unit);
    }
}

/* The force between teeth at their pitch point, of a multiplier of one. False: no memory, or its row is a row of J. */
static bool add_teeth(search *x, int c)
{
    const kmp_gear *gear = x->model->closures[c].gear;
    kmp_gear_numbers mesh;
    double force[3], pitch[3];
    if (!gear->rigid || !kmp_gear_numbers_of(x->model, &x->model->closures[c], &mesh))
        return false;
    turned(x->poses[gear->carrier].r, mesh.force, force);
    turned(x->poses[gear->carrier].r, mesh.pitch, pitch);
    for (int i = 0; i < 3; i++)
        pitch[i] += x->poses[gear->carrier].p[i];
    add_load(x, c, false, force);
    memcpy(x->columns[x->count - 1].place, pitch, sizeof pitch);
    return true;
}

/* The loads of a closure between points; false: they are not known by its kind. */
static bool add_loads(search *x, int c)
{
    const kmp_closure *closure = &x->model->closures[c];
    const kmp_closure_parts *kind = kmp_closure_parts_of(closure->kind);
    const kmp_part *force = kind->force, *moment = kind->moment;
    double p[3], q[3], d[3], e[2][3], both[3];
    kmp_pose at;
    if (closure->gear)
        return add_teeth(x, c);
    if (closure->point[0] < 0 || force == &kmp_part_point_on_curve || force->load == kmp_part_effort)
        return false;
    point_place(x, closure->point[0], p);
    point_place(x, closure->point[1], q);
    for (int k = 0; k < 3; k++)
        d[k] = q[k] - p[k];
    for (int side = 0; side < 2; side++) {
        kmp_pose_of_point(x->model, x->poses, x->q, closure->point[side], &at);
        turned(at.r, closure->axis[side], e[side]);
    }
    if (force == &kmp_part_ball)
        add_all(x, c, false);
    else if (force == &kmp_part_line)
        add_across(x, c, false, e[0]);
    else if (force->rows > 0)
        add_load(x, c, false, force == &kmp_part_rod ? d : e[0]);
    if (moment == &kmp_part_aligned)
        add_all(x, c, true);
    else if (moment == &kmp_part_parallel)
        add_across(x, c, true, e[1]);
    else if (moment == &kmp_part_perpendicular) {
        kmp_cross3(e[0], e[1], both);
        add_load(x, c, true, both);
    } else if (moment == &kmp_part_twist) {
        for (int k = 0; k < 3; k++)
            both[k] = (e[0][k] + e[1][k]) / (1 + kmp_dot3(e[0], e[1]));
        add_load(x, c, true, both);
    }
    return true;
}

static void add_work(const search *x, int body, const double place[3], const double *load, double sign, double *work);

static void add_row(const search *x, int r, double *work)
{
    const kmp_pattern *p = &x->s->jacobian;
    for (int k = 0; k < p->count; k++)
        if (p->row[k] == r)
            work[p->col[k]] += x->jacobian[k] * x->s->scale[p->col[k]] / x->s->row_scale[r];
}

/* The forces of the rows of a curve. */
static void add_curve(search *x, int c)
{
    const kmp_closure *closure = &x->model->closures[c];
    double q[3], *unit = x->curve, *row = x->curve + 3 * (ptrdiff_t)x->n, f[3];
    point_place(x, closure->point[1], q);
    memset(unit, 0, 3 * (size_t)x->n * sizeof *unit);
    for (int i = 0; i < 3; i++) {
        const double load[KMP_LOAD_SIZE] = {i == 0, i == 1, i == 2};
        for (int side = 0; side < 2; side++)
            add_work(x, x->model->points[closure->point[side]].body, q, load, side ? 1 : -1, unit + i * x->n);
    }
    for (int r = 0; r < x->s->m; r++) {
        if (x->s->rows[r].closure != c)
            continue;
        memset(row, 0, (size_t)x->n * sizeof *row);
        add_row(x, r, row);
        if (kmp_least_squares(x->n, 3, unit, row, ZERO, f) > 0)
            add_load(x, c, false, f);
    }
}

/* -- generalized forces ------------------------------------------------------------------------------ */

/* Adds the work of a load at a place of a body along each coordinate, `sign` times. */
static void add_work(const search *x, int body, const double place[3], const double *load, double sign, double *work)
{
    for (int b = body; b > 0; b = x->model->bodies[b].parent)
        for (int k = x->model->bodies[b].first_motion, i = 0; i < x->model->bodies[b].motion_count; k++, i++) {
            double arm[3], moved[3];
            for (int j = 0; j < 3; j++)
                arm[j] = (place[j] - x->place[k][j]) / x->s->length;
            kmp_cross3(x->axis[k], arm, moved);
            work[k] +=
                sign * (x->model->motions[k].rotation ? kmp_dot(3, load, moved) + kmp_dot(3, load + 3, x->axis[k])
                                                      : kmp_dot(3, load, x->axis[k]));
        }
}

/* The bodies that a load is between, and its place. */
static void find_loaded(const search *x, const column *c, int body[2], double place[3])
{
    const kmp_closure *closure = &x->model->closures[c->closure];
    if (closure->gear) {
        memcpy(body, closure->gear->wheel, sizeof closure->gear->wheel);
        memcpy(place, c->place, sizeof c->place);
        return;
    }
    for (int side = 0; side < 2; side++)
        body[side] = x->model->points[closure->point[side]].body;
    point_place(x, closure->point[1], place);
}

static void fill_column(const search *x, const column *c, double *work)
{
    memset(work, 0, (size_t)x->n * sizeof *work);
    if (c->row >= 0) {
        add_row(x, c->row, work);
        return;
    }
    double q[3];
    int body[2];
    find_loaded(x, c, body, q);
    add_work(x, body[1], q, c->load, 1, work);
    add_work(x, body[0], q, c->load, -1, work);
}

/* -- loads of joints ---------------------------------------------------------------------------------- */

static void put_on(search *x, int body, const double place[3], const double *load, double factor)
{
    double arm[3], moment[3];
    for (int i = 0; i < 3; i++)
        arm[i] = place[i] / x->s->length;
    kmp_cross3(arm, load, moment);
    for (int i = 0; i < 3; i++) {
        x->on_body[body][i] += factor * load[i];
        x->on_body[body][3 + i] += factor * (load[3 + i] + moment[i]);
    }
}

/* Sums loads up from the leaves: `out` (body_count) is then what each joint carries, about its point. */
static void carry(search *x)
{
    const kempe_model *model = x->model;
    for (int b = model->body_count - 1; b > 0; b--) {
        const kmp_body *body = &model->bodies[b];
        double *sum = x->on_body[b], place[3], moment[3];
        for (int i = 0; i < KMP_LOAD_SIZE; i++)
            x->on_body[body->parent][i] += sum[i];
        const int point = body->loads_parent ? body->at : body->to;
        memcpy(place, x->poses[body->loads_parent ? body->parent : b].p, sizeof place);
        if (point >= 0)
            point_place(x, point, place);
        for (int i = 0; i < 3; i++)
            place[i] /= x->s->length;
        kmp_cross3(place, sum, moment);
        for (int i = 0; i < 3; i++)
            sum[3 + i] -= moment[i];
    }
}

static void mark(bool *flags, const double *load, double least)
{
    for (int i = 0; i < KMP_LOAD_SIZE; i++)
        flags[i] = flags[i] || fabs(load[i]) > least;
}

/* Marks what a self-balanced set of loads has. */
static void mark_set(search *x, const double *z)
{
    const kempe_model *model = x->model;
    memset(x->on_body, 0, (size_t)model->body_count * sizeof *x->on_body);
    for (int c = 0, j = 0; c < model->closure_count; c++) {
        double whole[KMP_LOAD_SIZE] = {0};
        bool loads = false;
        for (; j < x->count && x->columns[j].closure == c; j++) {
            loads = x->columns[j].row < 0;
            whole[0] += loads ? 0 : fabs(z[j]);
            for (int i = 0; i < KMP_LOAD_SIZE; i++)
                whole[i] += z[j] * x->columns[j].load[i];
        }
        mark(x->found->of_closure[c], whole, PART);
        if (x->set)
            memcpy(x->set + KMP_LOAD_SIZE * ((ptrdiff_t)x->sets * (model->closure_count + x->joints) + c), whole,
                   sizeof whole);
        if (!loads) {
            x->unknown = whole[0] > PART ? c : x->unknown;
            continue;
        }
        double q[3];
        int body[2];
        find_loaded(x, &x->columns[j - 1], body, q);
        put_on(x, body[1], q, whole, 1);
        put_on(x, body[0], q, whole, -1);
        if (model->closures[c].gear && kmp_dot(3, whole, whole) > PART * PART) /* teeth separate by |lambda| */
            x->unknown = c;
    }
    carry(x);
    for (int b = 1; b < model->body_count; b++)
        if (model->bodies[b].motion_count > 0)
            mark(x->found->of_body[b], x->on_body[b], PART);
    for (int k = 0; x->set && k < KMP_LOAD_SIZE * x->joints; k++) {
        const int body = x->joint[k / KMP_LOAD_SIZE], at = x->sets * (model->closure_count + x->joints);
        const double load = x->on_body[body][k % KMP_LOAD_SIZE];
        x->set[KMP_LOAD_SIZE * (at + model->closure_count) + k] = model->bodies[body].loads_parent ? load : -load;
    }
    x->sets++;
}

/* Loads of masses under gravity and random accelerations of the coordinates. */
static void load_masses(search *x)
{
    const kempe_model *model = x->model;
    unsigned state = 7;
    double size = 1e-30;
    for (int i = 0; i < 3; i++)
        size = fmax(size, fabs(model->gravity[i].value));
    memset(x->on_body, 0, (size_t)model->body_count * sizeof *x->on_body);
    for (int k = 0; k < x->n; k++)
        x->work[k] = size * kmp_walk_random(&state);
    for (int b = 1; b < model->body_count; b++) {
        const kmp_body *body = &model->bodies[b];
        double com[3], local[3] = {body->com[0].value, body->com[1].value, body->com[2].value}, spin[3] = {0};
        double load[KMP_LOAD_SIZE] = {0}, back[3], own[3];
        turned(x->poses[b].r, local, com);
        for (int i = 0; i < 3; i++) {
            com[i] += x->poses[b].p[i];
            load[i] = -model->gravity[i].value;
        }
        for (int up = b; up > 0; up = model->bodies[up].parent)
            for (int k = model->bodies[up].first_motion, i = 0; i < model->bodies[up].motion_count; k++, i++) {
                double arm[3], moved[3];
                bool rotation = model->motions[k].rotation;
                for (int j = 0; j < 3; j++)
                    arm[j] = (com[j] - x->place[k][j]) / x->s->length;
                kmp_cross3(x->axis[k], arm, moved);
                for (int j = 0; j < 3; j++) {
                    spin[j] += rotation ? x->axis[k][j] * x->work[k] : 0;
                    load[j] += (rotation ? moved[j] : x->axis[k][j]) * x->work[k];
                }
            }
        static const int at[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
        for (int i = 0; i < 3; i++)
            back[i] = x->poses[b].r[0][i] * spin[0] + x->poses[b].r[1][i] * spin[1] + x->poses[b].r[2][i] * spin[2];
        for (int i = 0; i < 3; i++) {
            own[i] = 0;
            for (int j = 0; j < 3; j++)
                own[i] += body->inertia[at[i][j]].value * back[j] / (x->s->length * x->s->length);
        }
        for (int i = 0; i < 3; i++)
            load[i] *= body->mass.value;
        turned(x->poses[b].r, own, load + 3);
        put_on(x, b, com, load, 1);
    }
    carry(x);
}

/* True if masses load what is marked, or if rows that coordinates move share. */
static bool is_loaded(search *x, bool moving)
{
    double most = 0, marked = 0;
    load_masses(x);
    for (int b = 1; b < x->model->body_count; b++)
        for (int i = 0; i < KMP_LOAD_SIZE; i++) {
            most = fmax(most, fabs(x->on_body[b][i]));
            marked = fmax(marked, x->found->of_body[b][i] ? fabs(x->on_body[b][i]) : 0);
        }
    return moving || marked > ZERO * most;
}

/* -- the whole ---------------------------------------------------------------------------------------- */

/* Collects A by columns. Coordinates that move both bodies alike leave rounding, which is not an entry. */
static bool collect(search *x, kmp_arena *room)
{
    for (int pass = 0; pass < 2; pass++) {
        for (int j = 0, e = 0; j < x->count; j++) {
            fill_column(x, &x->columns[j], x->work);
            for (int k = 0; k < x->n; k++)
                if (!(fabs(x->work[k]) <= EMPTY)) {
                    if (pass) {
                        x->entry_row[e] = k;
                        x->entry[e] = x->work[k];
                    }
                    e++;
                }
            x->columns[j].empty = e == x->start[j];
            x->start[j + 1] = e;
        }
        if (pass == 0)
            KMP_ARENA_MAKE(room, KMP_ROOM(int, (size_t)x->start[x->count] + 1, &x->entry_row),
                           KMP_ROOM(double, (size_t)x->start[x->count] + 1, &x->entry));
        if (room->failed)
            return false;
    }
    return true;
}

/* Pivots of A and its rank; -1: no memory, or A is not finite. */
static int find_rank(search *x, kmp_arena *room)
{
    const int least = x->n < x->count ? x->n : x->count, nz = x->start[x->count];
    int rank = 0, *col = KMP_ARENA_NEW(room, int, nz + 1);
    kmp_entries a = {x->n, x->count, nz, x->entry_row, col, x->entry};
    for (int j = 0; col && j < x->count; j++) {
        x->c[j] = j;
        for (int e = x->start[j]; e < x->start[j + 1]; e++)
            col[e] = j;
    }
    if (!col || (nz > 0 && !kmp_sparse_complete(&a, NULL, x->r, x->c, x->pivots, NULL)) ||
        (nz > 0 && isnan(x->pivots[0])))
        return -1;
    while (nz > 0 && rank < least && x->pivots[rank] > ZERO * x->pivots[0])
        rank++;
    for (int k = 0; k < x->n; k++)
        x->place_of_row[k] = -1;
    for (int i = 0; i < rank; i++)
        x->place_of_row[x->r[i]] = i;
    return rank;
}

/* The factors of the rows and columns of the pivots. NULL: no memory. */
static kmp_sparse *factor(const search *x, int rank, kmp_arena *room)
{
    const int most = x->start[x->count] + 1;
    int *row = KMP_ARENA_NEW(room, int, most), *col = KMP_ARENA_NEW(room, int, most), nz = 0;
    double *value = KMP_ARENA_NEW(room, double, most);
    for (int i = 0; !room->failed && i < rank; i++)
        for (int e = x->start[x->c[i]]; e < x->start[x->c[i] + 1]; e++)
            if (x->place_of_row[x->entry_row[e]] >= 0) {
                row[nz] = x->place_of_row[x->entry_row[e]];
                col[nz] = i;
                value[nz++] = x->entry[e];
            }
    kmp_sparse *sparse = room->failed ? NULL : kmp_sparse_new(rank, nz, row, col, false);
    if (!sparse || kmp_sparse_factor(sparse, value) == KMP_SPARSE_FACTORED)
        return sparse;
    kmp_sparse_free(sparse);
    return NULL;
}

/* The set in which column c[k], which does not belong to a pivot, has a part: z has the size 1. */
static void find_set(const search *x, kmp_sparse *sparse, int rank, int k, double *right)
{
    memset(right, 0, ((size_t)rank + 1) * sizeof *right);
    for (int e = x->start[x->c[k]]; e < x->start[x->c[k] + 1]; e++)
        if (x->place_of_row[x->entry_row[e]] >= 0)
            right[x->place_of_row[x->entry_row[e]]] = -x->entry[e];
    if (sparse)
        (void)kmp_sparse_solve(sparse, 1, right);
    double size = sqrt(1 + kmp_dot(rank, right, right));
    memset(x->z, 0, (size_t)x->count * sizeof *x->z);
    for (int i = 0; i < rank; i++)
        x->z[x->c[i]] = right[i] / size;
    x->z[x->c[k]] = 1 / size;
}

static bool find_sets(search *x, kmp_arena *room)
{
    bool moving = false;
    const int rank = collect(x, room) ? find_rank(x, room) : -1;
    double *right = KMP_ARENA_NEW(room, double, rank + 2);
    kmp_sparse *sparse = rank > 0 && rank < x->count ? factor(x, rank, room) : NULL;
    const bool ok = rank >= 0 && right && (sparse || rank == 0 || rank == x->count);
    const int loads = x->joint ? KMP_LOAD_SIZE * (x->model->closure_count + x->joints) : 0;
    x->set = ok && loads > 0 ? KMP_ARENA_NEW(room, double, (size_t)loads *(size_t)(x->count - rank + 1)) : NULL;
    for (int k = rank; ok && !room->failed && k < x->count; k++) {
        find_set(x, sparse, rank, k, right);
        for (int j = 0; j < x->count; j++)
            if (!x->columns[j].empty && fabs(x->z[j]) > PART)
                moving = x->found->of_rows[x->columns[j].closure] = true;
        mark_set(x, x->z);
    }
    kmp_sparse_free(sparse);
    x->found->loaded = ok && is_loaded(x, moving);
    return ok && !room->failed;
}

/* Takes from the loads their part along the sets. False: no memory. */
static bool take_sets(const search *x, kmp_arena *room, double *loads)
{
    const int all = KMP_LOAD_SIZE * (x->model->closure_count + x->joints);
    double *part = KMP_ARENA_NEW(room, double, x->sets + 1), *scaled = KMP_ARENA_NEW(room, double, all + 1);
    for (int k = 0; !room->failed && k < all; k++)
        scaled[k] = loads[k] / (k % KMP_LOAD_SIZE < 3 ? 1 : x->s->length);
    if (room->failed || kmp_least_squares(all, x->sets, x->set, scaled, ZERO, part) < 0)
        return false;
    for (int j = 0; j < x->sets; j++)
        for (int k = 0; k < all; k++)
            loads[k] -= part[j] * x->set[(ptrdiff_t)j * all + k] * (k % KMP_LOAD_SIZE < 3 ? 1 : x->s->length);
    return true;
}

/* The loads of closures and `joints` become the loads of least norm; NULL: they are not requested. */
static kempe_status distribute_loads(kmp_evaluator *eval, double t, const double *q, kmp_arena *arena,
                                     kmp_shared_loads *found, int joints, const int *joint, double *loads)
{
    const kempe_system *s = eval->system;
    const kempe_model *model = s->model;
    const size_t most = KMP_KIND_MAX_ROWS * (size_t)model->closure_count + (size_t)s->m, n = (size_t)s->n;
    const size_t bodies = (size_t)model->body_count;
    search x = {.s = s, .model = model, .n = kmp_model_coordinates(model), .found = found};
    x.q = q;
    x.joints = joints;
    x.joint = joint;
    x.unknown = -1;
    kmp_arena room = {0};
    *found = (kmp_shared_loads){0};
    found->of_body = (bool(*)[KMP_LOAD_SIZE])(void *)KMP_ARENA_NEW(arena, bool, KMP_LOAD_SIZE * model->body_count);
    found->of_closure =
        (bool(*)[KMP_LOAD_SIZE])(void *)KMP_ARENA_NEW(arena, bool, KMP_LOAD_SIZE *(model->closure_count + 1));
    found->of_rows = KMP_ARENA_NEW(arena, bool, model->closure_count + 1);
    KMP_TRY(kmp_made(s->context, found->of_body && found->of_closure && found->of_rows));
    if (s->m == 0 && model->closure_count == kmp_model_friction_count(model))
        return KEMPE_OK;
    KMP_ARENA_MAKE(&room, KMP_ROOM(double, most + 1, &x.z), KMP_ROOM(int, most + 1, &x.start, &x.c),
                   KMP_ROOM(double, n + 1, &x.work, &x.pivots), KMP_ROOM(int, n + 1, &x.r, &x.place_of_row),
                   KMP_ROOM(double, 4 * n, &x.curve));
    x.poses = KMP_ARENA_NEW(&room, kmp_pose, model->body_count);
    x.columns = KMP_ARENA_NEW(&room, column, (int)most);
    x.axis = (double(*)[3])(void *)KMP_ARENA_NEW(&room, double, 3 * s->n);
    x.place = (double(*)[3])(void *)KMP_ARENA_NEW(&room, double, 3 * s->n);
    x.on_body = (double(*)[KMP_LOAD_SIZE])(void *)KMP_ARENA_NEW(&room, double, KMP_LOAD_SIZE *(int)bodies);
    bool ok = !room.failed;
    if (ok) {
        kmp_eval_closure(eval, t, q);
        x.jacobian = eval->jacobian;
        kmp_pose_motions(model, q, x.poses, x.axis, x.place);
        /* Columns. */
        for (int c = 0; c < x.model->closure_count; c++) {
            /* In a model with flexible bodies a column is a row of J, which also does work on their coordinates. */
            const bool flexible = x.model->flexible_count > 0;
            if (kmp_closure_is_of_modes(&x.model->closures[c]) || (!flexible && add_loads(&x, c)))
                continue;
            if (!flexible && x.model->closures[c].curve_count > 0) {
                add_curve(&x, c);
                continue;
            }
            for (int r = 0; r < x.s->m; r++)
                if (x.s->rows[r].closure == c)
                    x.columns[x.count++] = (column){.closure = c, .row = r};
        }
        ok = x.count == 0 || find_sets(&x, &room);
    }
    ok = ok && (!loads || x.sets == 0 || x.unknown >= 0 || take_sets(&x, &room, loads));
    kmp_arena_free(&room);
    KMP_TRY(kmp_made(s->context, ok));
    if (loads && x.unknown >= 0)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "loads of least norm: '%s' shares loads with joints, and its own load on bodies is not known; "
                        "omit --loads",
                        model->closures[x.unknown].name);
    return KEMPE_OK;
}

kempe_status kmp_find_shared_loads(kmp_evaluator *eval, double t, const double *q, kmp_arena *arena,
                                   kmp_shared_loads *found)
{
    return distribute_loads(eval, t, q, arena, found, 0, NULL, NULL);
}

kempe_status kmp_least_norm_loads(kmp_evaluator *eval, double t, const double *q, int joints, const int *joint,
                                  double *loads)
{
    kmp_arena arena = {0};
    kmp_shared_loads found;
    const int none = 0;
    kempe_status status = distribute_loads(eval, t, q, &arena, &found, joints, joint ? joint : &none, loads);
    kmp_arena_free(&arena);
    return status;
}

kempe_status kmp_load_share_read(kempe_context *context, const char *word, bool *least_norm)
{
    *least_norm = word && strcmp(word, "least-norm") == 0;
    return !word || *least_norm ? KEMPE_OK
                                : kmp_fail(context, KEMPE_E_ARGUMENT, "loads '%s': least-norm is possible", word);
}

/* The components that are shared at both of two configurations. */
static kempe_status shared_between(kmp_evaluator *eval, const double t[2], const double *const q[2], kmp_arena *arena,
                                   kmp_shared_loads *found)
{
    const kempe_model *model = eval->system->model;
    kmp_shared_loads first;
    KMP_TRY(kmp_find_shared_loads(eval, t[0], q[0], arena, &first));
    KMP_TRY(kmp_find_shared_loads(eval, t[1], q[1], arena, found));
    for (int i = 0; i < KMP_LOAD_SIZE; i++) {
        for (int b = 0; b < model->body_count; b++)
            found->of_body[b][i] = found->of_body[b][i] && first.of_body[b][i];
        for (int c = 0; c < model->closure_count; c++)
            found->of_closure[c][i] = found->of_closure[c][i] && first.of_closure[c][i];
    }
    for (int c = 0; c < model->closure_count; c++)
        found->of_rows[c] = found->of_rows[c] && first.of_rows[c];
    return KEMPE_OK;
}

/* The components that are shared in joint k: bodies' joints (from 1), then closures; NULL for the ground and drives. */
static const bool *shared_in(const kempe_model *model, const kmp_shared_loads *found, int k, const char **name)
{
    const int c = k - model->body_count;
    if (k == 0 || (c >= 0 && kmp_closure_is_drive(&model->closures[c])))
        return NULL;
    *name = c < 0 ? model->bodies[k].joint : model->closures[c].name;
    return c < 0 ? found->of_body[k] : found->of_closure[c];
}

static int count_of(const bool *flags)
{
    int count = 0;
    for (int i = 0; flags && i < KMP_LOAD_SIZE; i++)
        count += flags[i];
    return count;
}

static bool is_same(const bool *a, const bool *b)
{
    return a && b && memcmp(a, b, KMP_LOAD_SIZE * sizeof *a) == 0;
}

/* Joints with the same components are named together: "A, B: x, y; C: z". */
int kmp_put_shared_loads(kmp_text *text, const kempe_model *model, const kmp_shared_loads *found)
{
    const int joints = model->body_count + model->closure_count;
    int count = 0;
    for (int k = 0; k < joints; k++) {
        const char *name = NULL;
        const bool *flags = shared_in(model, found, k, &name);
        const int components = count_of(flags);
        bool listed = components == 0;
        for (int before = 0; before < k && !listed; before++)
            listed = is_same(shared_in(model, found, before, &name), flags);
        if (listed)
            continue;
        const char *between = count > 0 ? "; " : "";
        for (int other = k; other < joints; other++)
            if (is_same(shared_in(model, found, other, &name), flags)) {
                kmp_text_printf(text, "%s%s", between, name);
                between = ", ";
                count += components;
            }
        between = ": ";
        for (int i = 0; i < KMP_LOAD_SIZE; i++)
            if (flags[i]) {
                kmp_text_printf(text, "%s%s", between, kmp_load_words[i]);
                between = ", ";
            }
    }
    return count;
}

/* -- warnings ----------------------------------------------------------------------------------------- */

static void warn(kempe_context *context, const char *names, bool least_norm)
{
    kmp_log(context, KEMPE_LOG_WARNING,
            least_norm ? "loads that are not unique: %s. Redundant constraints share them by the stiffness of the "
                         "bodies; these are the shares of least norm"
                       : "loads that are not unique: %s. Redundant constraints share them; these are one solution. A "
                         "bushing makes them unique; --loads least-norm gives the smallest shares",
            names);
}

/* An operand that is the size of a force which is shared, as friction uses it: of -number closures. */
static bool is_shared_size(const kmp_expr *e, const void *user)
{
    const kmp_shared_loads *found = user;
    bool shared = false;
    for (int c = e->index; e->kind == KMP_EXPR_LAMBDA && !e->measure && c < e->index - e->number; c++)
        shared = shared || found->of_rows[c];
    return shared;
}

/* Friction whose level is a load that is shared has another level for each stiffness of the bodies. True: there is
 * some. */
static bool doubt_friction(const kempe_system *s, const kmp_shared_loads *found)
{
    bool any = false;
    for (int k = 0; found->loaded && k < s->model->force_count; k++) {
        const kmp_force *force = &s->model->forces[k];
        if (!kmp_expr_find(force->effort, is_shared_size, found) &&
            !kmp_expr_find(force->holding_effort, is_shared_size, found))
            continue;
        kmp_doubt(s->context,
                  "friction '%s' depends on a load that redundant constraints share, and that is not unique: use "
                  "joints that leave more motions free, or a bushing",
                  force->name);
        any = true;
    }
    return any;
}

bool kmp_doubt_shared_friction(const kempe_system *system, double t, const double *q)
{
    bool any = false;
    kmp_evaluator *eval = !kmp_context_is_quiet(system->context) && kmp_model_presses_friction(system->model)
                              ? kmp_eval_new_for(system, "tape", NULL, KMP_EVAL_WEIGHS)
                              : NULL;
    kmp_arena arena = {0};
    kmp_shared_loads found;
    if (eval && kmp_find_shared_loads(eval, t, q, &arena, &found) == KEMPE_OK)
        any = doubt_friction(system, &found);
    kmp_arena_free(&arena);
    kmp_eval_free(eval);
    return any;
}

kempe_status kmp_shared_loads_between(kmp_evaluator *eval, const double t[2], const double *const q[2], int joints,
                                      const int *joint, const double *loads, kmp_arena *arena, kmp_shared_loads *found)
{
    const kempe_model *model = eval->system->model;
    KMP_TRY(shared_between(eval, t, q, arena, found));
    found->matters = found->loaded;
    for (int k = 0; k < KMP_LOAD_SIZE * (model->closure_count + joints); k++) {
        const int c = k / KMP_LOAD_SIZE, i = k % KMP_LOAD_SIZE;
        const bool *shared =
            c < model->closure_count ? found->of_closure[c] : found->of_body[joint[c - model->closure_count]];
        found->matters = found->matters || (shared[i] && !(fabs(loads[k]) < EMPTY));
    }
    return KEMPE_OK;
}

kempe_status kmp_report_shared_loads(const kempe_system *system, const kmp_shared_loads *found, bool least_norm,
                                     kmp_arena *arena, const char **text)
{
    kmp_text names = {0};
    (void)doubt_friction(system, found);
    const int count = found->matters ? kmp_put_shared_loads(&names, system->model, found) : 0;
    if (found->matters && count > 0)
        warn(system->context, names.s ? names.s : "", least_norm);
    *text = names.failed ? NULL : kmp_arena_strdup(arena, names.s ? names.s : "");
    kmp_text_free(&names);
    return kmp_made(system->context, *text);
}

/* -- outputs ------------------------------------------------------------------------------------------ */

typedef struct shown_loads {
    kmp_shared_loads found;
    kmp_text names;
    int count;
} shown_loads;

/* Names components `from` to `to` of a force or a moment; the shared ones as bits. */
static unsigned name_load(shown_loads *w, const kempe_model *model, bool joint, int index, bool moment, int from,
                          int to)
{
    const char *name = joint ? model->bodies[index].joint : model->closures[index].name;
    unsigned shared = 0;
    for (int i = from; i < to; i++) {
        if (!(joint ? w->found.of_body[index] : w->found.of_closure[index])[i + 3 * moment])
            continue;
        kmp_text_printf(&w->names, "%s%s(%s).%c", w->count++ ? ", " : "", moment ? "moment" : "reaction", name,
                        "xyz"[i]);
        shared |= 1u << i;
    }
    return shared;
}

/* Names two bearings whose joint has shared loads. Values that are zero do not show in theirs. */
static void name_bearings(shown_loads *w, const kmp_bearing_pair *pair)
{
    const bool *load = pair->closure < 0 ? w->found.of_body[pair->body] : w->found.of_closure[pair->closure];
    bool shared = false;
    for (int i = 0; i < KMP_LOAD_SIZE; i++)
        shared = shared || load[i];
    kmp_text name = {0};
    kmp_text_printf(&name, "bearing(%s)", pair->name);
    const bool known = w->names.s && name.s && strstr(w->names.s, name.s);
    if (shared && !known)
        kmp_text_printf(&w->names, "%s%s", w->count++ ? ", " : "", name.s ? name.s : "");
    kmp_text_free_part(&w->names, &name);
}

/* A component. A size has the others too, and does not show that the shared ones are zero. */
static unsigned name_measure(shown_loads *w, const kempe_model *model, bool joint, int index, bool moment, int number)
{
    if (number < KMP_MEASURE_SIZE)
        return name_load(w, model, joint, index, moment, number, number + 1);
    (void)name_load(w, model, joint, index, moment, 0, 3);
    return 0;
}

static unsigned name_expression(shown_loads *w, const kempe_model *model, const kmp_expr *e)
{
    unsigned shared = 0;
    if (!e)
        return 0;
    const kmp_measure *m = e->kind == KMP_EXPR_MEASURE || e->kind == KMP_EXPR_LAMBDA ? e->measure : NULL;
    const bool moment = m && (m->kind == KMP_MEASURE_MOMENT || m->kind == KMP_MEASURE_JOINT_MOMENT);
    const bool joint = m && (m->kind == KMP_MEASURE_JOINT_REACTION || m->kind == KMP_MEASURE_JOINT_MOMENT);
    if (joint || moment || (m && m->kind == KMP_MEASURE_REACTION))
        shared = name_measure(w, model, joint, m->argument[0].closure, moment, e->number);
    if (m && m->kind == KMP_MEASURE_BEARING)
        name_bearings(w, &model->bearings[m->argument[0].closure]);
    shared |= name_expression(w, model, e->a) | name_expression(w, model, e->b) | name_expression(w, model, e->c);
    return shared ? 1 : 0;
}

/* Names what an output shows of loads that are shared; these components as bits. */
static unsigned name_output(shown_loads *w, const kempe_model *model, const kmp_output *output)
{
    const bool joint = output->kind == KMP_OUTPUT_JOINT_REACTION || output->kind == KMP_OUTPUT_JOINT_MOMENT;
    const bool moment = output->kind == KMP_OUTPUT_MOMENT || output->kind == KMP_OUTPUT_JOINT_MOMENT;
    if (output->kind == KMP_OUTPUT_SENSOR)
        return name_expression(w, model, model->sensors[output->index].expr);
    if (output->kind == KMP_OUTPUT_BEARING)
        name_bearings(w, &model->bearings[output->index]);
    return joint || moment || output->kind == KMP_OUTPUT_REACTION
               ? name_load(w, model, joint, output->index + joint, moment, 0, 3)
               : 0;
}

kempe_status kmp_warn_of_shared_loads(kmp_evaluator *eval, const double t[2], const double *const q[2],
                                      const double *shown, bool least_norm)
{
    const kempe_model *model = eval->system->model;
    kmp_arena arena = {0};
    shown_loads w = {0};
    bool zero = true;
    kempe_status status = shared_between(eval, t, q, &arena, &w.found);
    for (int o = 0, at = 0; status == KEMPE_OK && o < model->output_count; o++) {
        const bool named = !least_norm || model->outputs[o].kind == KMP_OUTPUT_SENSOR;
        const unsigned shared = named ? name_output(&w, model, &model->outputs[o]) : 0;
        for (int i = 0; i < 3; i++)
            zero = zero && (!(shared >> i & 1) || fabs(shown[at + i]) < EMPTY);
        at += kmp_output_width(model, &model->outputs[o]);
    }
    if (status == KEMPE_OK)
        (void)doubt_friction(eval->system, &w.found);
    if (w.count > 0 && (w.found.loaded || !zero))
        warn(eval->system->context, w.names.s ? w.names.s : "", false);
    status = w.names.failed ? kmp_fail_memory(eval->system->context) : status;
    kmp_text_free(&w.names);
    kmp_arena_free(&arena);
    return status;
}
