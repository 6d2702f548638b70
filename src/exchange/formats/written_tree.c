/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/formats/written_tree.h"
#include "base/memory.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/importing.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

void kmp_export_leave_out(kmp_export *w, const char *sentence, ...)
{
    kmp_text words = {0};
    kempe_context *context = w->model->context;
    KMP_TEXT_ARGUMENTS(&words, sentence);
    if (words.failed)
        w->arena.failed = true;
    else if (kmp_context_is_strict(context))
        w->status = kmp_fail(context, KEMPE_E_INPUT, "%s: %s", w->model->source.file, words.s);
    else
        kmp_log(context, KEMPE_LOG_WARNING, "%s: %s", w->model->source.file, words.s);
    kmp_text_free(&words);
}

/* -- frames -------------------------------------------------------------------------------------------- */

static kmp_pose turned(const double r[3][3])
{
    kmp_pose f = {.p = {0}};
    memcpy(f.r, r, sizeof f.r);
    return f;
}

/* A point in its body. */
static kmp_pose point_pose(const kempe_model *model, int point)
{
    kmp_pose f = kmp_frame_none();
    const kmp_point *p = point >= 0 ? &model->points[point] : NULL;
    for (int i = 0; p && i < 3; i++)
        f.p[i] = p->at[i].value;
    if (p && p->turned)
        memcpy(f.r, p->axes, sizeof f.r);
    return f;
}

kmp_pose kmp_export_point(const kmp_export *w, int point)
{
    kmp_pose at = point_pose(w->model, point);
    return kmp_frame_in(&w->in_link[w->model->points[point].body], &at);
}

void kmp_export_angles(const kmp_pose *pose, double rpy[3])
{
    const double(*r)[3] = pose->r;
    rpy[0] = atan2(r[2][1], r[2][2]);
    rpy[1] = atan2(-r[2][0], hypot(r[2][1], r[2][2]));
    double s = sin(rpy[0]), c = cos(rpy[0]);
    rpy[2] = atan2(s * r[0][2] - c * r[0][1], c * r[1][1] - s * r[1][2]);
}

void kmp_export_numbers(kmp_text *text, int count, const double *values)
{
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k > 0 ? " " : "");
        kmp_text_number(text, values[k] + 0.0);
    }
}

void kmp_export_attribute(kmp_text *text, const char *key, int count, const double *values)
{
    kmp_text_printf(text, " %s=\"", key);
    kmp_export_numbers(text, count, values);
    kmp_text_put(text, "\"");
}

void kmp_export_name(kmp_text *text, const char *name)
{
    for (const char *s = name ? name : ""; *s; s++)
        kmp_text_printf(text, "%c", kmp_import_is_letter(*s) || *s == ' ' || *s == '-' ? *s : '_');
}

/* -- links --------------------------------------------------------------------------------------------- */

static kmp_writer_link *add_link(kmp_export *w, const char *name, int parent)
{
    kmp_writer_link *l = &w->links[w->count++];
    *l = (kmp_writer_link){
        .name = name, .joint = name, .body = -1, .parent = parent, .kind = KMP_WRITER_FIXED, .at = kmp_frame_none()};
    return l;
}

static const char *clean(kmp_export *w, const char *name)
{
    char *copy = kmp_arena_strdup(&w->arena, name);
    for (char *s = copy; s && *s; s++)
        if (*s == '.')
            *s = '_';
    return copy ? copy : "";
}

/* A joint to the ground with displacements along x, y, z and rotations about them. */
static bool is_free(const kempe_model *model, const kmp_body *body)
{
    bool is = body->motion_count == 6 && !body->reversed && body->parent == 0;
    for (int k = 0; is && k < 6; k++) {
        const kmp_motion *m = &model->motions[body->first_motion + k];
        is = m->rotation == (k >= 3) && m->axis[k % 3] == 1;
    }
    return is;
}

static void add_chain(kmp_export *w, int b)
{
    const kempe_model *model = w->model;
    const kmp_body *body = &model->bodies[b];
    kmp_pose at = point_pose(model, body->at), frame = turned(body->frame), to = point_pose(model, body->to),
             end = kmp_frame_inverse(&to);
    if (body->turned && !body->reversed)
        at = kmp_frame_in(&at, &frame);
    if (body->turned && body->reversed) {
        kmp_pose back = kmp_frame_inverse(&frame);
        end = kmp_frame_in(&back, &end);
    }
    at = kmp_frame_in(&w->in_link[body->parent], &at);
    int parent = w->of_body[body->parent], steps = is_free(model, body) ? 0 : body->motion_count;
    for (int k = 0; k < steps || k == 0; k++) {
        const kmp_motion *m = steps > 0 ? &model->motions[body->first_motion + k] : NULL;
        bool last = k + 1 >= steps;
        kmp_writer_link *l =
            add_link(w, last ? body->name : clean(w, kmp_arena_printf(&w->arena, "%s.link", m->name)), parent);
        l->at = k == 0 ? at : kmp_frame_none();
        l->joint = m ? clean(w, m->name) : body->joint;
        l->armature = steps == 1 ? body->armature.value : 0;
        if (m) {
            l->kind = m->rotation ? KMP_WRITER_TURNS : KMP_WRITER_SLIDES;
            memcpy(l->axis, m->axis, sizeof l->axis);
            w->of_motion[m - model->motions] = w->count - 1;
        } else if (body->motion_count > 0)
            l->kind = KMP_WRITER_FREE;
        parent = w->count - 1;
    }
    w->links[parent].body = b;
    w->of_body[b] = parent;
    w->in_link[b] = end;
}

bool kmp_export_mass(const kmp_export *w, int link, double *mass, double com[3], double inertia[6])
{
    static const int entry[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    int b = w->links[link].body;
    const kmp_body *body = b > 0 ? &w->model->bodies[b] : NULL;
    bool any = body && body->mass.value != 0;
    for (int k = 0; body && k < 6; k++)
        any = any || body->inertia[k].value != 0;
    if (!any)
        return false;
    const kmp_pose *f = &w->in_link[b];
    double at[3];
    for (int i = 0; i < 3; i++)
        at[i] = body->com[i].value;
    kmp_frame_vector(f, at, com);
    for (int i = 0; i < 3; i++)
        com[i] += f->p[i];
    *mass = body->mass.value;
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++)
                for (int l = 0; l < 3; l++)
                    sum += f->r[i][k] * body->inertia[entry[k][l]].value * f->r[j][l];
            inertia[entry[i][j]] = sum;
        }
    return true;
}

/* -- forces -------------------------------------------------------------------------------------------- */

/* Takes up a force that belongs to a joint with one motion. */
static bool take_force(kmp_export *w, const kmp_force *force)
{
    int k = force->motion >= 0 ? w->of_motion[force->motion] : -1;
    kmp_writer_link *l = k >= 0 ? &w->links[k] : NULL;
    if (l && force->kind == KMP_FORCE_JOINT_SPRING && (l->stiffness == 0 || force->stiffness.value == 0)) {
        l->damping += force->damping.value;
        if (force->stiffness.value != 0) {
            l->stiffness = force->stiffness.value;
            l->rest = force->rest.value;
        }
        return true;
    }
    bool constant = force->kind == KMP_FORCE_FRICTION && !force->effort && !force->has_speed && !force->has_static &&
                    !force->has_regularise && force->mu.value == 0 && force->contact == 0;
    if (l && constant && l->friction == 0)
        l->friction = force->level.value;
    return l && constant;
}

bool kmp_export_follower(const kmp_export *w, const kmp_closure *c, int *link, int *leader, double *multiplier,
                         double *offset)
{
    const bool screw = kmp_closure_row_of(c)->needs == KMP_NEEDS_COUPLING;
    if (screw || c->term_count != 2 || !c->constant) {
        *link = screw ? w->of_motion[c->motion] : -1;
        *leader = screw ? w->of_motion[c->motion + 1] : -1;
        *multiplier = c->number.value / (2 * acos(-1));
        *offset = 0;
        return *link >= 0 && *leader >= 0;
    }
    *link = w->of_motion[c->terms[0].motion];
    *leader = w->of_motion[c->terms[1].motion];
    *multiplier = -c->terms[1].factor.value / c->terms[0].factor.value;
    *offset = c->constant->value / c->terms[0].factor.value;
    return *link >= 0 && *leader >= 0;
}

bool kmp_export_mimic(kmp_export *w, int link, int *leader, double *multiplier, double *offset)
{
    for (int k = 0; k < w->model->closure_count; k++) {
        int own;
        if (!w->said[k] && kmp_export_follower(w, &w->model->closures[k], &own, leader, multiplier, offset) &&
            own == link)
            return w->said[k] = true;
    }
    return false;
}

/* -- shapes -------------------------------------------------------------------------------------------- */

bool kmp_export_shape(kmp_export *w, int shape, int link, bool ellipsoids, kmp_writer_shape *out)
{
    const kmp_shape *s = &w->model->shapes[shape];
    if (s->body != w->links[link].body || s->kind == KMP_SHAPE_LINE || (s->kind == KMP_SHAPE_ELLIPSOID && !ellipsoids))
        return false;
    kmp_pose at = kmp_frame_none();
    double along[3];
    for (int k = 0; k < 3; k++) {
        at.p[k] = s->at[k].value;
        along[k] = s->along[k].value;
    }
    if (s->kind == KMP_SHAPE_CYLINDER || s->kind == KMP_SHAPE_CAPSULE)
        kmp_complete_axes(2, along, at.r);
    else if (s->turned)
        memcpy(at.r, s->axes, sizeof at.r);
    *out = (kmp_writer_shape){.kind = s->kind,
                              .at = kmp_frame_in(&w->in_link[s->body], &at),
                              .mesh = s->mesh ? s->mesh->path : NULL,
                              .coloured = s->colour >= 0};
    bool three = s->kind == KMP_SHAPE_BOX || s->kind == KMP_SHAPE_ELLIPSOID;
    for (int k = 0; k < 3; k++)
        out->size[k] = s->kind == KMP_SHAPE_MESH ? s->scale.value
                       : three                   ? s->edge[k].value
                       : k == 0                  ? s->radius.value
                       : k == 1                  ? s->length.value
                                                 : 0;
    for (int k = 0; k < 3 && out->coloured; k++)
        out->rgba[k] = (double)(s->colour >> (16 - 8 * k) & 255) / 255;
    out->rgba[3] = s->opacity;
    w->drawn++;
    return true;
}

void kmp_export_text(kmp_text *text, const char *s)
{
    static const char *const signs[] = {"&&amp;", "<&lt;", ">&gt;", "\"&quot;"};
    for (; *s; s++) {
        size_t k = 0;
        while (k < sizeof signs / sizeof *signs && signs[k][0] != *s)
            k++;
        if (k < sizeof signs / sizeof *signs)
            kmp_text_put(text, signs[k] + 1);
        else
            kmp_text_printf(text, "%c", *s);
    }
}

/* -- points -------------------------------------------------------------------------------------------- */

static bool is_end(const kempe_model *model, int point)
{
    for (int b = 1; b < model->body_count; b++)
        if (model->bodies[b].at == point || model->bodies[b].to == point)
            return true;
    for (int k = 0; k < model->closure_count; k++)
        if (model->closures[k].point[0] == point || model->closures[k].point[1] == point)
            return true;
    return false;
}

static bool is_taken(kmp_export *w, int point, const char *name)
{
    for (int k = 0; k < w->count; k++)
        if (strcmp(name, w->links[k].name) == 0 || (k > 0 && strcmp(name, w->links[k].joint) == 0))
            return true;
    for (int k = 0; k < w->model->closure_count; k++)
        if (strcmp(name, w->model->closures[k].name) == 0)
            return true;
    for (int k = 0; k < point; k++)
        if (w->point_name[k] && strcmp(name, w->point_name[k]) == 0)
            return true;
    return false;
}

const char *kmp_export_point_name(kmp_export *w, int point)
{
    const kmp_point *p = &w->model->points[point];
    if (!p->name || strcmp(p->name, "origin") == 0 || is_end(w->model, point))
        return NULL;
    kmp_text text = {0};
    kmp_export_name(&text, w->links[w->of_body[p->body]].name);
    kmp_text_put(&text, "_");
    kmp_export_name(&text, p->name);
    const char *name = kmp_text_keep(&text, &w->arena);
    while (name && is_taken(w, point, name))
        name = kmp_arena_printf(&w->arena, "%s_", name);
    w->point_name[point] = name;
    return name;
}

/* -- the whole ----------------------------------------------------------------------------------------- */

static const struct {
    const char *word, *name;
    void (*write)(kmp_export *w);
} writers[] = {
#define KMP_WRITER(word, write, name, meaning) {word, name, write},
#include "exchange/formats/writers.def"
#undef KMP_WRITER
};

enum { WRITERS = sizeof writers / sizeof *writers };

/* Names the parts that are not written. */
static void leave_out_parts(kmp_export *w)
{
    const kempe_model *model = w->model;
    for (int k = 0; k < model->closure_count; k++)
        if (!w->said[k] && !kmp_closure_is_of_modes(&model->closures[k]))
            kmp_export_leave_out(w, "loop '%s' is not written: %s has no closure of kind '%s' as it is here",
                                 model->closures[k].name, w->format, kmp_closure_word(&model->closures[k]));
    for (int k = 0; k < model->force_count; k++)
        if (!w->said_force[k] && !take_force(w, &model->forces[k]))
            kmp_export_leave_out(w, "force '%s' is not written: %s has no such force", model->forces[k].name,
                                 w->format);
    for (int k = 0; k < model->rope_count; k++)
        if (!w->said_rope[k])
            kmp_export_leave_out(w, "the path of rope '%s' is not written: %s has no such path", model->ropes[k].name,
                                 w->format);
    for (int k = 0; k < model->wheel_count; k++)
        kmp_export_leave_out(w, "wheel '%s' is not written: %s has no wheels on rails", model->wheels[k].name,
                             w->format);
    for (int k = 0; k < model->state_count; k++)
        kmp_export_leave_out(w, "state '%s' is not written: %s has no differential equations", model->states[k].name,
                             w->format);
    for (int k = 0; k < w->count; k++)
        if (w->links[k].armature != 0)
            kmp_export_leave_out(w, "the armature of joint '%s' is not written: %s has none", w->links[k].joint,
                                 w->format);
    for (int k = 0; k < model->sensor_count; k++)
        kmp_export_leave_out(w, "sensor '%s' is not written: %s has no expressions", model->sensors[k].name, w->format);
    for (int k = 0; k < kmp_model_given_inputs(model); k++)
        kmp_export_leave_out(w, "input '%s' is not written: %s has no functions of time", model->inputs[k].name,
                             w->format);
    if (model->shape_count > w->drawn)
        kmp_export_leave_out(w, "%d of %d shapes are not written: %s has no such pictures there",
                             model->shape_count - w->drawn, model->shape_count, w->format);
    for (int k = 0; k < kmp_model_coordinates(model); k++)
        if (model->start.q[k].value != 0 || model->start.qd[k].value != 0)
            kmp_export_leave_out(w, "the start of coordinate '%s' is not written: %s has no start values",
                                 model->motions[k].name, w->format);
}

static kempe_status write(kmp_export *w, void (*function)(kmp_export *w))
{
    const kempe_model *model = w->model;
    int room = model->body_count + model->motion_count;
    if (!KMP_ARENA_MAKE(
            &w->arena, KMP_ROOM(kmp_writer_link, room, &w->links), KMP_ROOM(int, model->body_count, &w->of_body),
            KMP_ROOM(kmp_pose, model->body_count, &w->in_link), KMP_ROOM(int, model->motion_count + 1, &w->of_motion),
            KMP_ROOM(bool, model->closure_count + 1, &w->said), KMP_ROOM(bool, model->force_count + 1, &w->said_force),
            KMP_ROOM(bool, model->rope_count + 1, &w->said_rope),
            KMP_ROOM(const char *, model->point_count + 1, &w->point_name)))
        return kmp_fail_memory(model->context);
    for (int k = 0; k < model->motion_count; k++)
        w->of_motion[k] = -1;
    bool named = false;
    for (int b = 1; b < model->body_count; b++)
        named = named || strcmp(model->bodies[b].name, "world") == 0;
    kmp_writer_link *ground = add_link(w, named ? "world_link" : "world", -1);
    ground->kind = KMP_WRITER_ROOT;
    ground->body = 0;
    w->in_link[0] = kmp_frame_none();
    for (int b = 1; b < model->body_count; b++)
        add_chain(w, b);
    for (int k = 0; k < model->force_count; k++)
        (void)take_force(w, &model->forces[k]);
    function(w);
    for (int k = 0; k < w->count; k++) /* taken up again to be named */
        w->links[k].stiffness = w->links[k].friction = 0;
    leave_out_parts(w);
    return w->arena.failed || w->text->failed ? kmp_fail_memory(model->context) : w->status;
}

kempe_status kempe_model_export(const kempe_model *model, const char *format, char **text)
{
    KMP_WANTED_BOTH(model, text);
    KMP_WANTED(model->context, format, "format");
    kmp_context_clear(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    if (strcmp(format, "yaml") == 0) { /* the document by which another format was read, or that a program built */
        if (!model->source.document)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT, "'%s' is in Kempe's language already: copy the file",
                            model->source.file);
        *text = kmp_strdup(model->source.document);
        return kmp_made(model->context, *text);
    }
    int k = 0;
    while (k < WRITERS && strcmp(writers[k].word, format) != 0)
        k++;
    if (k == WRITERS) {
        kmp_text sentence = {0};
        kmp_text_printf(&sentence, "unknown format '%s'; there are ", format);
        for (int i = 0; i < WRITERS; i++)
            kmp_text_printf(&sentence, "%s, ", writers[i].word);
        kmp_text_put(&sentence, "yaml");
        return kmp_fail_text(model->context, KEMPE_E_ARGUMENT, &sentence);
    }
    if (model->flexible_count > 0)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "body '%s' is flexible: %s has only rigid bodies; write the model with a rigid body instead",
                        model->bodies[model->flexibles[0].body].name, writers[k].name);
    kmp_text out = {0};
    kmp_export w = {.model = model, .format = writers[k].name, .text = &out};
    kempe_status status = write(&w, writers[k].write);
    kmp_arena_free(&w.arena);
    char *s = status == KEMPE_OK ? kmp_text_take(&out) : NULL;
    kmp_text_free(&out);
    if (s)
        *text = s;
    return status == KEMPE_OK ? kmp_made(model->context, s) : status;
}
