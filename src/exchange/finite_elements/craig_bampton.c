/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/finite_elements/craig_bampton.h"
#include "base/union_find.h"
#include "exchange/finite_elements/held_mesh.h"
#include "linalg/dense/three.h"
#include <math.h>
#include <string.h>

/* RIGID: values of rigid motions over the first one of the body; supports leave more. In slender bodies the digits of
 * the file do so, too: loads of rigid motions below DIGITS of the sum of their parts, at every node, are rounding,
 * unlike the loads of a support. Their values are then bounded by ROUNDED. */
static const double RIGID = 1e-6, DIGITS = 1e-12, ROUNDED = 1e-3;

/* Displacements that differ by less are equally large: of two, the first one gives a mode its sign. */
static const double EQUAL = 1e-6;

enum { MODES_MOST = 200 }; /* as the reader of bodies takes */

/* -- what the mesh is -------------------------------------------------------------------------------- */

/* Elements and rigid interfaces join all nodes. */
static kempe_status check_connected(const kmp_finite_mesh *mesh, int count, const kmp_interface *interfaces)
{
    const kmp_mesh_rows *k = &mesh->stiffness;
    const int n = mesh->node_count;
    int *up = KMP_ARENA_NEW(mesh->arena, int, n), *size = KMP_ARENA_NEW(mesh->arena, int, n), parts = 0, least = -1;
    if (!up || !size)
        return kmp_fail_memory(mesh->context);
    for (int i = 0; i < n; i++)
        up[i] = i;
    for (int i = 0; i < k->n; i++)
        for (int e = k->start[i]; e < k->start[i + 1]; e++)
            if (k->value[e] != 0)
                up[kmp_root_of(up, i / 3)] = kmp_root_of(up, k->col[e] / 3);
    for (int p = 0; p < count; p++)
        for (int i = 1; i < interfaces[p].count; i++)
            up[kmp_root_of(up, interfaces[p].nodes[i])] = kmp_root_of(up, interfaces[p].nodes[0]);
    for (int i = 0; i < n; i++)
        size[kmp_root_of(up, i)]++;
    for (int i = 0; i < n; i++) {
        parts += size[i] > 0;
        if (size[i] > 0 && (least < 0 || size[i] < size[least]))
            least = i;
    }
    if (parts == 1)
        return KEMPE_OK;
    int node = 0;
    while (node < n - 1 && kmp_root_of(up, node) != least)
        node++;
    return kmp_mesh_refuse(mesh,
                           "it has %d parts that no element joins; one of them has %d node%s, among them node %ld: "
                           "join them, or write the matrices of one part",
                           parts, size[least], size[least] == 1 ? "" : "s", kmp_mesh_number(mesh, node));
}

/* Column `way` of the rigid motions about a place, at a node: three translations and three rotations. */
static void rigid_motion(const kmp_finite_mesh *mesh, int node, const double about[3], int way, double u[3])
{
    double axis[3] = {0}, r[3];
    for (int i = 0; i < 3; i++) {
        u[i] = way == i;
        axis[i] = way == 3 + i;
        r[i] = mesh->node[3 * (ptrdiff_t)node + i] - about[i];
    }
    if (way >= 3)
        kmp_cross3(axis, r, u);
}

/* The largest load of a displacement over the sum of its parts. */
static double residual_of(const kmp_finite_mesh *mesh, const double *u, const double *load)
{
    const kmp_mesh_rows *k = &mesh->stiffness;
    double largest = 0;
    for (int i = 0; i < k->n; i++) {
        double sum = 0;
        for (int e = k->start[i]; e < k->start[i + 1]; e++)
            sum += fabs(k->value[e] * u[k->col[e]]);
        largest = sum > 0 ? fmax(largest, fabs(load[i]) / sum) : largest;
    }
    return largest;
}

/* Values of K x = value M x among rigid motions of all nodes: zeros, if nothing supports the mesh. *residual: their
 * largest load over the sum of its parts. */
static kempe_status rigid_values(const kmp_finite_mesh *mesh, const kmp_modal_body *b, double values[6],
                                 double *residual)
{
    const ptrdiff_t n = 3 * (ptrdiff_t)mesh->node_count;
    double *u, *load, k[36] = {0}, m[36] = {0}, x[36], centre[3];
    if (!KMP_ARENA_MAKE(mesh->arena, KMP_ROOM(double, 6 * n, &u), KMP_ROOM(double, n, &load)))
        return kmp_fail_memory(mesh->context);
    for (int i = 0; i < 3; i++)
        centre[i] = b->moment[i] / b->mass;
    for (int way = 0; way < 6; way++)
        for (int node = 0; node < mesh->node_count; node++)
            rigid_motion(mesh, node, centre, way, u + n * way + 3 * (ptrdiff_t)node);
    for (int a = 0; a < 6; a++) {
        kmp_mesh_load(mesh, u + n * a, load);
        *residual = fmax(*residual, residual_of(mesh, u + n * a, load));
        for (int c = 0; c < 6; c++)
            for (ptrdiff_t i = 0; i < n; i++)
                k[6 * c + a] += u[n * c + i] * load[i];
    }
    for (int i = 0; i < 9; i++) { /* translations, and rotations about the centre of mass */
        const double second = b->second[i] - b->mass * centre[i / 3] * centre[i % 3];
        const double sum = b->second[0] + b->second[4] + b->second[8] - b->mass * kmp_dot3(centre, centre);
        m[6 * (i / 3) + i % 3] = i % 4 == 0 ? b->mass : 0;
        m[6 * (3 + i / 3) + 3 + i % 3] = (i % 4 == 0 ? sum : 0) - second;
    }
    for (int a = 0; a < 6; a++)
        for (int c = 0; c < a; c++)
            k[6 * a + c] = k[6 * c + a] = (k[6 * a + c] + k[6 * c + a]) / 2;
    if (kmp_modal_values(b->arena, 6, k, m, values, x))
        return KEMPE_OK;
    return b->arena->failed
               ? kmp_fail_memory(mesh->context)
               : kmp_mesh_refuse(mesh, "its mass lies on a line or at a point, and does not resist rotation");
}

static kempe_status check_rigid(const kmp_finite_mesh *mesh, double first, double residual, double values[6])
{
    const double most = residual <= DIGITS ? ROUNDED : RIGID;
    int zeros = 0;
    for (int k = 0; k < 6; k++) {
        values[k] /= first;
        zeros += fabs(values[k]) <= most;
    }
    return zeros == 6 ? KEMPE_OK
                      : kmp_mesh_refuse(mesh,
                                        "its stiffness resists %d of six rigid motions (%.2g %.2g %.2g %.2g %.2g %.2g "
                                        "of the first elastic one): a supported mesh, wrong nodes, or too few digits",
                                        6 - zeros, values[0], values[1], values[2], values[3], values[4], values[5]);
}

/* -- modes before they are orthogonal ---------------------------------------------------------------- */

/* Mode `k` of the body from displacements of all nodes. */
static void put_mode(kmp_modal_body *b, int k, const double *u)
{
    for (ptrdiff_t i = 0; i < 3 * (ptrdiff_t)b->node_count; i++)
        b->mode[i * b->count + k] = u[i];
}

/* Six modes of each interface but the first: it moves as a rigid body, the others are held, the rest is in static
 * equilibrium. */
static kempe_status add_static(const kmp_finite_mesh *mesh, kmp_held_mesh *held, int count,
                               const kmp_interface *interfaces, kmp_modal_body *b)
{
    double *u = KMP_ARENA_NEW(mesh->arena, double, 3 * (ptrdiff_t)mesh->node_count);
    if (!u)
        return kmp_fail_memory(mesh->context);
    for (int p = 1; p < count; p++) {
        const kmp_interface *own = &interfaces[p];
        double mean[3] = {0};
        for (int k = 0; k < own->count; k++)
            for (int i = 0; i < 3; i++)
                mean[i] += mesh->node[3 * (ptrdiff_t)own->nodes[k] + i] / own->count;
        for (int way = 0; way < 6; way++) {
            memset(u, 0, 3 * (size_t)mesh->node_count * sizeof *u);
            for (int k = 0; k < own->count; k++)
                rigid_motion(mesh, own->nodes[k], mean, way, u + 3 * (ptrdiff_t)own->nodes[k]);
            KMP_TRY(kmp_held_mesh_settle(held, u));
            put_mode(b, 6 * (p - 1) + way, u);
        }
    }
    return KEMPE_OK;
}

/* Phi' K Phi. Loads of slow modes are small differences of large ones: in double sums the first value of a blade has
 * lost eight digits. */
static bool reduce_stiffness(const kmp_finite_mesh *mesh, kmp_modal_body *b)
{
    const kmp_mesh_rows *k = &mesh->stiffness;
    const int n = b->count;
    long double *row, *sum;
    if (!KMP_ARENA_MAKE(mesh->arena, KMP_ROOM(long double, n, &row), KMP_ROOM(long double, n *n, &sum)))
        return false;
    for (int i = 0; i < k->n; i++) {
        memset(row, 0, (size_t)n * sizeof *row);
        for (int e = k->start[i]; e < k->start[i + 1]; e++)
            for (int l = 0; l < n; l++)
                row[l] += (long double)k->value[e] * b->mode[(ptrdiff_t)k->col[e] * n + l];
        for (int j = 0; j < n; j++)
            for (int l = 0; l < n; l++)
                sum[j * n + l] += b->mode[(ptrdiff_t)i * n + j] * row[l];
    }
    for (int j = 0; j < n; j++)
        for (int l = 0; l < n; l++)
            b->stiffness[j * n + l] = (double)((sum[j * n + l] + sum[l * n + j]) / 2);
    return true;
}

/* -- orthogonal modes of the frame ------------------------------------------------------------------- */

static bool flip(kmp_modal_body *b)
{
    const int n = b->count;
    double *v = KMP_ARENA_NEW(b->arena, double, n *n);
    for (int k = 0; v && k < n; k++) {
        double largest = 0;
        for (ptrdiff_t i = 0; i < 3 * (ptrdiff_t)b->node_count; i++)
            if (fabs(b->mode[i * n + k]) > (1 + EQUAL) * fabs(largest))
                largest = b->mode[i * n + k];
        v[k * n + k] = largest < 0 ? -1 : 1;
    }
    return v && kmp_modal_combine(b, n, v);
}

static kempe_status make_orthogonal(const kmp_finite_mesh *mesh, kmp_modal_body *b, double *values)
{
    const int n = b->count;
    double *mass, *x;
    if (!KMP_ARENA_EACH(mesh->arena, double, n *n, &mass, &x))
        return kmp_fail_memory(mesh->context);
    kmp_modal_mass(b, mass);
    if (!kmp_modal_values(b->arena, n, b->stiffness, mass, values, x))
        return b->arena->failed ? kmp_fail_memory(mesh->context)
                                : kmp_mesh_refuse(mesh, "its mass matrix is not positive: two modes have no mass");
    return kmp_made(mesh->context, kmp_modal_combine(b, n, x) && flip(b));
}

/* Modes less the rigid motions that their frame does not have. */
static kempe_status take_frame(const kmp_finite_mesh *mesh, kmp_modal_body *b, kmp_flexible_frame frame)
{
    double *rigid = KMP_ARENA_NEW(mesh->arena, double, 6 * b->count);
    const double origin[3] = {b->places[0].at[0], b->places[0].at[1], b->places[0].at[2]};
    if (!rigid)
        return kmp_fail_memory(mesh->context);
    kmp_modal_move_origin(b, origin);
    if (!kmp_modal_frame(b, frame, rigid))
        return kmp_mesh_refuse(mesh, "its mass lies on a line or at a point, and does not resist rotation");
    kmp_modal_subtract(b, rigid);
    kmp_modal_move_origin(b, (double[3]){-origin[0], -origin[1], -origin[2]});
    return KEMPE_OK;
}

/* -- the reduction ----------------------------------------------------------------------------------- */

static kempe_status take_held_modes(const kmp_finite_mesh *mesh, kmp_held_mesh *held, int statics, int modes,
                                    kmp_reduced_mesh *to)
{
    const int all = kmp_held_mesh_count(held);
    double *x;
    if (modes > all)
        return kmp_mesh_refuse(mesh, "with its interfaces held the mesh has %d modes, and %d are wanted", all, modes);
    to->left_out = modes < all;
    to->held_count = modes + to->left_out;
    if (!(to->held_values = KMP_ARENA_NEW(mesh->arena, double, to->held_count)))
        return kmp_fail_memory(mesh->context);
    KMP_TRY(kmp_held_mesh_modes(held, to->held_count, to->held_values, &x));
    for (int k = 0; k < modes; k++)
        put_mode(&to->body, statics + k, x + 3 * (ptrdiff_t)mesh->node_count * k);
    return KEMPE_OK;
}

static kempe_status fill(const kmp_finite_mesh *mesh, kmp_held_mesh *held, int count, const kmp_interface *interfaces,
                         int modes, kmp_flexible_frame frame, kmp_reduced_mesh *to)
{
    kmp_modal_body *b = &to->body;
    const int statics = 6 * (count - 1);
    double residual = 0;
    *b = (kmp_modal_body){.arena = mesh->arena, .count = statics + modes, .node_count = mesh->node_count};
    if (!KMP_ARENA_MAKE(mesh->arena, KMP_ROOM(double, 3 * (ptrdiff_t)mesh->node_count, &b->node),
                        KMP_ROOM(double, 3 * (ptrdiff_t)mesh->node_count * b->count, &b->mode),
                        KMP_ROOM(double, b->count * b->count, &b->stiffness), KMP_ROOM(double, b->count, &to->values),
                        KMP_ROOM(double, count, &to->interface_mass)))
        return kmp_fail_memory(mesh->context);
    memcpy(b->node, mesh->node, 3 * (size_t)mesh->node_count * sizeof *b->node);
    KMP_TRY(take_held_modes(mesh, held, statics, modes, to));
    KMP_TRY(add_static(mesh, held, count, interfaces, b));
    KMP_TRY(kmp_made(mesh->context, reduce_stiffness(mesh, b)));
    const kmp_mesh_rows *m = &mesh->mass;
    int *row = KMP_ARENA_NEW(mesh->arena, int, m->start[m->n]);
    for (int i = 0; row && i < m->n; i++)
        for (int e = m->start[i]; e < m->start[i + 1]; e++)
            row[e] = i;
    KMP_TRY(kmp_made(mesh->context, row && kmp_modal_integrate(b, m->start[m->n], row, m->col, m->value)));
    for (int p = 0; p < count; p++) {
        if (kmp_modal_add_nodes(b, interfaces[p].count, interfaces[p].nodes) < 0)
            return kmp_fail_memory(mesh->context);
        for (int k = 0; k < interfaces[p].count; k++)
            for (int e = mesh->mass.start[interfaces[p].nodes[k]]; e < mesh->mass.start[interfaces[p].nodes[k] + 1];
                 e++)
                to->interface_mass[p] += mesh->mass.value[e];
    }
    KMP_TRY(take_frame(mesh, b, frame));
    KMP_TRY(make_orthogonal(mesh, b, to->values));
    KMP_TRY(rigid_values(mesh, b, to->rigid, &residual));
    KMP_TRY(check_rigid(mesh, to->values[0], residual, to->rigid));
    /* The checks of the reader of bodies: no rigid motion is left, and each mode has stiffness. */
    kmp_text why = {0};
    double *elastic = KMP_ARENA_NEW(mesh->arena, double, b->count * b->count);
    const int rigid = elastic ? kmp_modal_rigid(b, elastic, &why) : -1;
    kempe_status status = KEMPE_OK;
    if (why.s)
        status = kmp_mesh_refuse(mesh, "%s", why.s);
    else if (rigid != 0)
        status = rigid < 0 ? kmp_fail_memory(mesh->context)
                           : kmp_mesh_refuse(mesh, "%d of its modes are rigid motions", rigid);
    kmp_text_free(&why);
    return status;
}

kempe_status kmp_craig_bampton(const kmp_finite_mesh *mesh, int count, const kmp_interface *interfaces, int modes,
                               kmp_flexible_frame frame, kmp_reduced_mesh *reduced)
{
    kmp_held_mesh *held = NULL;
    const int all = 6 * (count - 1) + modes;
    if (all < 1)
        return kmp_fail(mesh->context, KEMPE_E_ARGUMENT,
                        "one interface has no static modes: give --modes N, or a second --interface");
    if (all > MODES_MOST)
        return kmp_fail(mesh->context, KEMPE_E_ARGUMENT,
                        "%d modes, six of them for each interface but the first, are "
                        "more than the %d of a body",
                        all, MODES_MOST);
    if (frame == KMP_FRAME_CHORD && count < 2)
        return kmp_fail(mesh->context, KEMPE_E_ARGUMENT,
                        "--frame chord is from the first interface to the second one: name both by --interface");
    KMP_TRY(check_connected(mesh, count, interfaces));
    KMP_TRY(kmp_held_mesh_new(mesh, count, interfaces, &held));
    reduced->library = kmp_held_mesh_library(held);
    kempe_status status = fill(mesh, held, count, interfaces, modes, frame, reduced);
    kmp_held_mesh_free(held);
    return status;
}
