/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/file.h"
#include "base/json.h"
#include "base/memory.h"
#include "exchange/finite_elements/craig_bampton.h"
#include "output/named_arrays.h"
#include "output/print.h"
#include <kempe/reduce.h>
#include <math.h>
#include <string.h>

struct kempe_reduction {
    kempe_context *context;
    kmp_arena arena;
    kmp_finite_mesh mesh;
    int interface_count;
    kmp_interface *interfaces;
    kmp_flexible_frame frame;
    kmp_reduced_mesh reduced;
    const char *written; /* the file; NULL: none yet */
};

/* -- making ------------------------------------------------------------------------------------------ */

static kempe_status make(kempe_reduction *r, const char *mesh, const kempe_reduce_options *o)
{
    enum { FRAMES = sizeof kmp_flexible_frame_words / sizeof *kmp_flexible_frame_words };
    int frame = 0;
    while (o->frame && frame < FRAMES && strcmp(o->frame, kmp_flexible_frame_words[frame]) != 0)
        frame++;
    if (frame == FRAMES)
        return kmp_fail(r->context, KEMPE_E_ARGUMENT, "--frame '%s' does not exist: clamped, chord or mean", o->frame);
    r->frame = (kmp_flexible_frame)frame;
    const char *const inputs[3] = {mesh, o->mass, o->nodes};
    for (int k = 0; k < 3; k++)
        if (inputs[k])
            KMP_TRY(kmp_context_note_source(r->context, inputs[k]));
    const char *path = kmp_arena_strdup(&r->arena, mesh);
    KMP_TRY(kmp_made(r->context, path));
    KMP_TRY(kmp_finite_mesh_read(r->context, &r->arena, path, o, &r->mesh));
    KMP_TRY(kmp_interfaces_read(&r->mesh, o->interfaces, &r->interface_count, &r->interfaces));
    KMP_TRY(kmp_craig_bampton(&r->mesh, r->interface_count, r->interfaces, o->modes, r->frame, &r->reduced));
    r->mesh.options = NULL;
    return KEMPE_OK;
}

kempe_status kempe_reduction_new(kempe_context *context, const char *mesh, const kempe_reduce_options *options,
                                 kempe_reduction **reduction)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, mesh, "mesh");
    KMP_WANTED(context, reduction, "reduction");
    KMP_OPTIONS(context, kempe_reduce_options, options);
    kmp_context_begin(context);
    KMP_MAKE(context, kempe_reduction, made);
    made->context = context;
    kempe_status status = make(made, mesh, options);
    return KMP_GIVE_OR_FREE(status, reduction, made, kempe_reduction_free);
}

KMP_FREES(kempe_reduction, reduction, kmp_arena_free(&reduction->arena))

KMP_GETTER(int kempe_reduction_mode_count(const kempe_reduction *reduction), reduction, reduction->reduced.body.count,
           0)
KMP_GETTER_AT(double kempe_reduction_frequency(const kempe_reduction *reduction, int k), reduction, k,
              reduction->reduced.body.count, sqrt(reduction->reduced.values[k]), NAN)

/* -- the file ---------------------------------------------------------------------------------------- */

#define SHAPE(...)                                                                                                     \
    (const int[])                                                                                                      \
    {                                                                                                                  \
        __VA_ARGS__                                                                                                    \
    }

/* Arrays of interfaces, one behind the other, and others in the order of the format. */
typedef struct laid {
    double *at, *shift, *turn, *field, *number;
    char **names;
} laid;

static bool lay(kempe_reduction *r, laid *l)
{
    const kmp_modal_body *b = &r->reduced.body;
    const int n = b->count, p = r->interface_count;
    if (!KMP_ARENA_MAKE(&r->arena, KMP_ROOM(double, 3 * p, &l->at), KMP_ROOM(double, 3 * n * p, &l->shift, &l->turn),
                        KMP_ROOM(double, 3 * n, &l->field), KMP_ROOM(double, b->node_count, &l->number),
                        KMP_ROOM(char *, p, &l->names)))
        return false;
    for (int k = 0; k < p; k++) {
        memcpy(l->at + 3 * k, b->places[k].at, sizeof b->places[k].at);
        memcpy(l->shift + 3 * n * k, b->places[k].shift, 3 * (size_t)n * sizeof *l->shift);
        memcpy(l->turn + 3 * n * k, b->places[k].turn, 3 * (size_t)n * sizeof *l->turn);
        if (!(l->names[k] = kmp_arena_strdup(&r->arena, r->interfaces[k].name)))
            return false;
    }
    for (int k = 0; k < n; k++)
        for (int i = 0; i < 3; i++)
            l->field[i * n + k] = b->field[3 * k + i];
    for (int k = 0; k < b->node_count; k++)
        l->number[k] = (double)kmp_mesh_number(&r->mesh, k);
    return true;
}

kempe_status kempe_reduction_write(kempe_reduction *r, const char *path)
{
    KMP_WANTED(NULL, r, "reduction");
    KMP_WANTED(r->context, path, "path");
    kmp_context_clear(r->context);
    if (strcmp(kmp_file_ending(path), ".npz") != 0)
        return kmp_fail(r->context, KEMPE_E_ARGUMENT, "%s: a body is written as .npz", path);
    char format[] = "kempe-flexible-1", units[] = "m kg s", *formats[] = {format}, *unit_words[] = {units};
    const kmp_modal_body *b = &r->reduced.body;
    const int n = b->count, p = r->interface_count;
    double *mass = KMP_ARENA_NEW(&r->arena, double, n *n);
    laid l;
    kmp_arrays arrays = {0};
    if (!mass || !lay(r, &l))
        return kmp_fail_memory(r->context);
    kmp_modal_mass(b, mass);
    kmp_arrays_words(&arrays, "format", 1, formats);
    kmp_arrays_words(&arrays, "units", 1, unit_words);
    kmp_arrays_tensor(&arrays, "K", 2, SHAPE(n, n), b->stiffness);
    kmp_arrays_tensor(&arrays, "M", 2, SHAPE(n, n), mass);
    kmp_arrays_tensor(&arrays, "m", 0, NULL, &b->mass);
    kmp_arrays_tensor(&arrays, "b0", 1, SHAPE(3), b->moment);
    kmp_arrays_tensor(&arrays, "P0", 2, SHAPE(3, 3), b->second);
    kmp_arrays_tensor(&arrays, "S", 2, SHAPE(3, n), l.field);
    kmp_arrays_tensor(&arrays, "Z0", 3, SHAPE(n, 3, 3), b->by_place);
    kmp_arrays_tensor(&arrays, "T", 4, SHAPE(n, n, 3, 3), b->by_field);
    kmp_arrays_words(&arrays, "interface_names", p, l.names);
    kmp_arrays_tensor(&arrays, "interface_place", 2, SHAPE(p, 3), l.at);
    kmp_arrays_tensor(&arrays, "interface_displacement", 3, SHAPE(p, 3, n), l.shift);
    kmp_arrays_tensor(&arrays, "interface_rotation", 3, SHAPE(p, 3, n), l.turn);
    kmp_arrays_tensor(&arrays, "nodes", 2, SHAPE(b->node_count, 3), b->node);
    kmp_arrays_tensor(&arrays, "modes", 3, SHAPE(b->node_count, 3, n), b->mode);
    kmp_arrays_tensor(&arrays, "node_number", 1, SHAPE(b->node_count), l.number);
    KMP_TRY(kmp_arrays_write(r->context, &arrays, path));
    r->written = kmp_arena_strdup(&r->arena, path);
    return kmp_made(r->context, r->written);
}

/* -- printing ---------------------------------------------------------------------------------------- */

/* Rounding of a number of this size is shown as zero. */
static double shown(double x, double size)
{
    return kmp_print_clean(x, KMP_PRINT_NOISE * fabs(size));
}

static double hertz(double value)
{
    return sqrt(value) / (2 * acos(-1.0));
}

static void put_frequencies(kmp_text *text, int count, const double *values)
{
    enum { A_LINE = 7 };
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%11.6g", k > 0 && k % A_LINE == 0 ? "\n                      " : "", hertz(values[k]));
    kmp_text_put(text, "\n");
}

/* The inertia about the centre of mass: xx, yy, zz, xy, xz, yz. */
static void inertia_of(const kmp_modal_body *b, double centre[3], double inertia[6])
{
    static const int at[6] = {0, 4, 8, 1, 2, 5};
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        centre[i] = b->moment[i] / b->mass;
        sum += b->second[4 * i] - b->moment[i] * centre[i];
    }
    for (int i = 0; i < 6; i++)
        inertia[i] = (i < 3 ? sum : 0) - b->second[at[i]] + b->mass * centre[at[i] / 3] * centre[at[i] % 3];
}

/* The first mode left out is as fast as the last one kept: what these make up is not determined. */
static bool is_split(const kmp_reduced_mesh *m)
{
    const double equal = 1 + 1e-6;
    const double *end = m->held_values + m->held_count - 1;
    return m->left_out && m->held_count > 1 && end[0] <= equal * end[-1];
}

static void show(kmp_text *text, const void *result)
{
    const kempe_reduction *r = result;
    const kmp_reduced_mesh *m = &r->reduced;
    const kmp_modal_body *b = &m->body;
    const int kept = m->held_count - m->left_out, statics = 6 * (r->interface_count - 1);
    double centre[3], inertia[6];
    inertia_of(b, centre, inertia);
    kmp_text_printf(text, "%s: %s, %d mode%s from %.6g to %.6g Hz, mass %.6g kg\n\n",
                    r->written ? r->written : r->mesh.path, kempe_outcome_text(KEMPE_OUTCOME_COMPLETE), b->count,
                    b->count == 1 ? "" : "s", hertz(m->values[0]), hertz(m->values[b->count - 1]), b->mass);
    kmp_text_put(text, "  frequencies, Hz     ");
    put_frequencies(text, b->count, m->values);
    kmp_text_put(text, "  held interfaces, Hz ");
    if (kept > 0)
        put_frequencies(text, kept, m->held_values);
    else
        kmp_text_put(text, "  none kept\n");
    if (m->left_out)
        kmp_text_printf(text, "  first left out, Hz  %11.6g%s\n", hertz(m->held_values[kept]),
                        is_split(m) ? ", equal to the last one kept: the choice is arbitrary, change --modes" : "");
    kmp_text_printf(text, "  modes               %11d static, %d with held interfaces; frame %s\n", statics, kept,
                    kmp_flexible_frame_words[r->frame]);
    double rigid = 0;
    for (int k = 0; k < 6; k++)
        rigid = fmax(rigid, fabs(m->rigid[k]));
    const double size = sqrt(fmax(fmax(inertia[0], inertia[1]), inertia[2]) / b->mass);
    kmp_text_put(text, "  centre of mass      ");
    for (int i = 0; i < 3; i++)
        kmp_text_printf(text, " %11.6g", shown(centre[i], size));
    kmp_text_put(text, " m\n  inertia, about it   ");
    for (int i = 0; i < 6; i++)
        kmp_text_printf(text, " %11.6g%s", shown(inertia[i], size * size * b->mass),
                        i == 2   ? " (xx yy zz)\n                      "
                        : i == 5 ? " kg m^2 (xy xz yz)\n"
                                 : "");
    kmp_text_printf(text,
                    "  rigid motions       %11.2g of the stiffness of the first mode, at most: 0 but for rounding\n\n"
                    "  interface        nodes    mass, kg   place, m\n",
                    rigid);
    for (int k = 0; k < r->interface_count; k++)
        kmp_text_printf(text, "  %-16s %5d  %10.6g   %.6g %.6g %.6g\n", r->interfaces[k].name, r->interfaces[k].count,
                        m->interface_mass[k], shown(b->places[k].at[0], size), shown(b->places[k].at[1], size),
                        shown(b->places[k].at[2], size));
    kmp_text_printf(text, "\n  from %s: %s, %d nodes, all joined by elements; solved by %s\n", r->mesh.path,
                    r->mesh.format, b->node_count, m->library);
    if (r->mesh.unused > 0)
        kmp_text_printf(text, "  %d node%s without stiffness and mass left out\n", r->mesh.unused,
                        r->mesh.unused == 1 ? "" : "s");
}

static void write_json(kmp_text *text, const void *result)
{
    const kempe_reduction *r = result;
    const kmp_reduced_mesh *m = &r->reduced;
    const kmp_modal_body *b = &m->body;
    double centre[3], inertia[6];
    kmp_json json = kmp_json_begin(text);
    inertia_of(b, centre, inertia);
    kmp_json_put(
        &json, "{ model %s status %s reason %s file %s format %s frame %s nodes %d unused_nodes %d factors %s modes %d",
        r->mesh.path, kempe_outcome_text(KEMPE_OUTCOME_COMPLETE), "", r->written, r->mesh.format,
        kmp_flexible_frame_words[r->frame], b->node_count, r->mesh.unused, m->library, b->count);
    kmp_json_array(&json, "frequencies");
    for (int k = 0; k < b->count; k++)
        kmp_json_number(&json, NULL, sqrt(m->values[k]));
    kmp_json_end(&json);
    kmp_json_array(&json, "held_frequencies");
    for (int k = 0; k < m->held_count - m->left_out; k++)
        kmp_json_number(&json, NULL, sqrt(m->held_values[k]));
    kmp_json_end(&json);
    kmp_json_number(&json, "first_left_out", m->left_out ? sqrt(m->held_values[m->held_count - 1]) : NAN);
    kmp_json_boolean(&json, "equal_left_out", is_split(m));
    kmp_json_number(&json, "mass", b->mass);
    kmp_json_numbers(&json, "centre", 3, centre);
    kmp_json_numbers(&json, "inertia", 6, inertia);
    kmp_json_numbers(&json, "rigid", 6, m->rigid);
    kmp_json_array(&json, "interfaces");
    for (int k = 0; k < r->interface_count; k++) {
        kmp_json_put(&json, "{ name %s nodes %d mass %g", r->interfaces[k].name, r->interfaces[k].count,
                     m->interface_mass[k]);
        kmp_json_numbers(&json, "place", 3, b->places[k].at);
        kmp_json_end(&json);
    }
    kmp_json_put(&json, "] }");
}

KMP_PRINT(kempe_reduction, reduction, reduction->context, write_json, show)
