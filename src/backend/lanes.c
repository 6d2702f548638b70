/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/lanes.h"
#include "backend/prepared.h"
#include "backend/sincos.h"
#include "backend/wasm/relaxed_sums.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include <math.h>

/* Copies one value of all lanes. */
static inline void lanes_copy(size_t width, double *to, const double *from)
{
    if (width == 8) /* a constant for the compiler: no call */
        memcpy(to, from, 8 * sizeof *to);
    else if (width == 16)
        memcpy(to, from, 16 * sizeof *to);
    else
        memcpy(to, from, width * sizeof *to);
}

struct kmp_lanes {
    kmp_frame frame;             /* of one instance: positions of values */
    kmp_code code;               /* operations, where there is no machine code */
    kmp_routine *const *segment; /* machine code; NULL: there is none */
    int width, at_once;          /* lanes; in one call of machine code */
    double *v;                   /* slots x width */
    kmp_lanes_sincos *sincos;    /* NULL: kmp_sincos_lanes */
    void *user;                  /* of it */
    const kmp_lanes *lender;     /* has found sines before; NULL: none */
    uint32_t *twin;              /* by angle: the lender's angle that had the same bits last */
};

int kmp_lanes_best(void)
{
    return kmp_code_runs(KMP_CODE_TWO_EIGHTS) ? 16 : kmp_code_form_of(4) ? 4 : 8;
}

/* -- construction ------------------------------------------------------------------------------------ */

/* The pages of the values are touched here: their first use in a run would interrupt it for each of them. */
static bool add_room(kmp_lanes *lanes)
{
    size_t w = (size_t)lanes->width, slots = lanes->frame.slots;
    lanes->v = kmp_arena_aligned(&lanes->frame.arena, slots * w);
    if (lanes->frame.arena.failed)
        return false;
    memset(lanes->v, 0, slots * w * sizeof *lanes->v);
    return true;
}

/* A constant in all lanes. */
static void spread(kmp_lanes *lanes, size_t slot, double value)
{
    size_t w = (size_t)lanes->width;
    for (size_t l = 0; l < w; l++)
        lanes->v[slot * w + l] = value;
}

/* With loops over the lanes. */
static bool make_plain(kmp_lanes *lanes, const kmp_program *p, const kmp_backend *blocks)
{
    kmp_layout layout = {0};
    bool ok = kmp_layout_init(&layout, &lanes->frame, p, kmp_code_is_straight, 0, blocks, 0) &&
              kmp_code_list(&lanes->code, &layout) && kmp_frame_add_blocks(&lanes->frame) && add_room(lanes);
    kmp_layout_free(&layout);
    for (size_t k = 0; ok && k < lanes->frame.slots; k++)
        spread(lanes, k, lanes->frame.v[k]);
    return ok;
}

static bool make(kmp_lanes *lanes, const kmp_program *p, kmp_code_form form)
{
    const kmp_prepared *prepared = kmp_prepared_of(p, form, 0);
    if (!prepared || !prepared->code.pages)
        return prepared && make_plain(lanes, p, &kmp_backend_native);
    lanes->segment = prepared->code.segment;
    lanes->at_once = kmp_code_at_once(form);
    bool ok = kmp_prepared_frame(prepared, &lanes->frame, NULL) && add_room(lanes);
    for (uint32_t k = 0; ok && k < prepared->start_count; k++)
        spread(lanes, (size_t)prepared->start[k].slot, prepared->start[k].value);
    return ok;
}

kmp_lanes *kmp_lanes_new(const kmp_program *program, int width, bool plain)
{
    kmp_lanes *lanes = KMP_NEW(kmp_lanes, 1);
    if (!lanes)
        return NULL;
    lanes->width = width;
    kmp_code_form form = plain ? 0 : kmp_code_form_of(width);
    if (form ? make(lanes, program, form) : make_plain(lanes, program, plain ? NULL : &kmp_backend_native))
        return lanes;
    kmp_lanes_free(lanes);
    return NULL;
}

void kmp_lanes_free(kmp_lanes *lanes)
{
    if (!lanes)
        return;
    kmp_frame_free(&lanes->frame);
    kmp_code_free(&lanes->code);
    kmp_free(lanes);
}

void kmp_lanes_set_sincos(kmp_lanes *lanes, kmp_lanes_sincos *sincos, void *user)
{
    lanes->sincos = sincos;
    lanes->user = user;
}

bool kmp_lanes_borrow_sines(kmp_lanes *lanes, const kmp_lanes *from)
{
    if (lanes->frame.angles == 0 || from->frame.angles == 0)
        return true;
    lanes->twin = KMP_ARENA_NEW(&lanes->frame.arena, uint32_t, lanes->frame.angles);
    lanes->lender = lanes->twin ? from : NULL;
    return lanes->twin;
}

int kmp_lanes_angles(const kmp_lanes *lanes)
{
    return (int)lanes->frame.angles;
}

bool kmp_lanes_native(const kmp_lanes *lanes)
{
    return lanes->segment;
}

/* Slots are written by the widest stores, since machine code reads them at once by the widest loads: a load of what
 * several stores have just written has to wait until these have reached the cache. */
static KMP_CLONES void set_eights(size_t w, const kmp_input_slot *feed, const kmp_input_slot *end, const double *values,
                                  double *v)
{
    for (; w == 8 && feed < end; feed++)
        KMP_EIGHT_AT(v + 8 * (size_t)feed->slot) = KMP_EIGHT_CONST(values + 8 * (size_t)feed->index);
    for (; feed < end; feed++)
        for (size_t l = 0; l < w; l += 8)
            KMP_EIGHT_AT(v + w * feed->slot + l) = KMP_EIGHT_CONST(values + w * (size_t)feed->index + l);
}

void kmp_lanes_set(kmp_lanes *lanes, kmp_input_kind kind, const double *values)
{
    const kmp_frame *f = &lanes->frame;
    size_t w = (size_t)lanes->width;
    int first = f->feed_start[kind], end = f->feed_start[kind + 1];
    if (w % 8 == 0 && end > first)
        set_eights(w, f->feeds + first, f->feeds + end, values, lanes->v);
    for (int k = first; k < end && w % 8 != 0; k++)
        lanes_copy(w, lanes->v + f->feeds[k].slot * w, values + f->feeds[k].index * w);
}

void kmp_lanes_set_one(kmp_lanes *lanes, kmp_input_kind kind, int lane, const double *values)
{
    const kmp_frame *f = &lanes->frame;
    size_t w = (size_t)lanes->width;
    for (int k = f->feed_start[kind]; k < f->feed_start[kind + 1]; k++)
        lanes->v[f->feeds[k].slot * w + (size_t)lane] = values[f->feeds[k].index];
}

bool kmp_lanes_takes(const kmp_lanes *lanes, kmp_input_kind kind)
{
    return lanes->frame.feed_start[kind + 1] > lanes->frame.feed_start[kind];
}

void kmp_lanes_places(kmp_lanes *lanes, kmp_input_kind kind, int count, double **place)
{
    const kmp_frame *f = &lanes->frame;
    for (int k = 0; k < count; k++)
        place[k] = NULL;
    for (int k = f->feed_start[kind]; k < f->feed_start[kind + 1]; k++)
        place[f->feeds[k].index] = lanes->v + f->feeds[k].slot * (size_t)lanes->width;
}

/* -- run --------------------------------------------------------------------------------------------- */

/* One operation on all lanes; the loops run only over `w`, so that the compiler vectorises them. */
static inline __attribute__((always_inline)) void run_operation(const kmp_straight *s, size_t w, double *v)
{
    double *d = v + s->d * w;
    const double *x = v + s->x * w, *y = v + s->y * w, *z = v + s->z * w;
    switch (s->op) {
    case KMP_DO_ADD:
        for (size_t l = 0; l < w; l++)
            d[l] = x[l] + y[l];
        break;
    case KMP_DO_SUB:
        for (size_t l = 0; l < w; l++)
            d[l] = x[l] - y[l];
        break;
    case KMP_DO_MUL:
        for (size_t l = 0; l < w; l++)
            d[l] = x[l] * y[l];
        break;
    case KMP_DO_DIV:
        for (size_t l = 0; l < w; l++)
            d[l] = x[l] / y[l];
        break;
    case KMP_DO_PRODUCT_ADD:
        for (size_t l = 0; l < w; l++)
            d[l] = fma(x[l], y[l], z[l]);
        break;
    case KMP_DO_PRODUCT_SUB:
        for (size_t l = 0; l < w; l++)
            d[l] = fma(x[l], y[l], -z[l]);
        break;
    case KMP_DO_SUB_PRODUCT:
        for (size_t l = 0; l < w; l++)
            d[l] = fma(-x[l], y[l], z[l]);
        break;
    default:
        for (size_t l = 0; l < w; l++)
            d[l] = sqrt(y[l]);
        break;
    }
}

static void run_operations(const kmp_straight *s, const kmp_straight *end, size_t w, double *v)
{
    for (; s < end; s++)
        run_operation(s, w, v);
}

KMP_MULTIPLY_ADD static void run_inline(const kmp_straight *s, const kmp_straight *end, size_t w, double *v)
{
    for (; s < end; s++)
        run_operation(s, w, v);
}

/* Of an even number of lanes. */
static void run_relaxed(const kmp_relaxed_sums *sums, const kmp_straight *s, const kmp_straight *end, size_t w,
                        double *v)
{
    for (; s < end; s++) {
        kmp_relaxed_lanes *loop = s->op == KMP_DO_PRODUCT_ADD   ? sums->product_add
                                  : s->op == KMP_DO_PRODUCT_SUB ? sums->product_sub
                                  : s->op == KMP_DO_SUB_PRODUCT ? sums->sub_product
                                                                : NULL;
        if (loop)
            loop(v + s->d * w, v + s->x * w, v + s->y * w, v + s->z * w, w * sizeof *v);
        else
            run_operation(s, w, v);
    }
}

static void run_arithmetic(kmp_lanes *lanes, uint32_t segment)
{
    const kmp_code *code = &lanes->code;
    const kmp_straight *operations = code->operations;
    if (lanes->segment) {
        for (int l = 0; lanes->segment[segment] && l < lanes->width; l += lanes->at_once)
            lanes->segment[segment](lanes->v + l);
        return;
    }
    const kmp_straight *first = operations + code->start[segment], *end = operations + code->start[segment + 1];
    const kmp_relaxed_sums *sums = lanes->width % 2 == 0 ? kmp_relaxed_sums_here() : NULL;
    if (sums)
        run_relaxed(sums, first, end, (size_t)lanes->width, lanes->v);
    else
        (kmp_has_multiply_add() ? run_inline : run_operations)(first, end, (size_t)lanes->width, lanes->v);
}

/* The slot of the first output of a stage. */
static size_t first_output(const kmp_frame *f, int stage)
{
    return f->out + (size_t)f->program->outputs[stage];
}

static KMP_CLONES void copy_eights(size_t w, const kmp_copy *copy, const kmp_copy *end, double *v)
{
    for (; w == 8 && copy < end; copy++)
        KMP_EIGHT_AT(v + 8 * (size_t)copy->to) = KMP_EIGHT_CONST(v + 8 * (size_t)copy->from) * copy->factor;
    for (; copy < end; copy++)
        for (size_t l = 0; l < w; l += 8)
            KMP_EIGHT_AT(v + w * copy->to + l) = KMP_EIGHT_CONST(v + w * copy->from + l) * copy->factor;
}

void kmp_lanes_gather(kmp_lanes *lanes, int stage, int first, int end)
{
    const kmp_frame *f = &lanes->frame;
    size_t w = (size_t)lanes->width, from = first_output(f, stage) + (size_t)first, to = from + (size_t)(end - first);
    uint32_t begin = f->copy_start[stage], past = f->copy_start[stage + 1];
    while (begin < past && f->copies[begin].to < from)
        begin++;
    while (past > begin && f->copies[past - 1].to >= to)
        past--;
    if (w % 8 == 0 && begin < past)
        copy_eights(w, f->copies + begin, f->copies + past, lanes->v);
    for (uint32_t k = begin; k < past && w % 8 != 0; k++)
        for (size_t l = 0; l < w; l++)
            lanes->v[f->copies[k].to * w + l] = lanes->v[f->copies[k].from * w + l] * f->copies[k].factor;
}

const double *kmp_lanes_values(const kmp_lanes *lanes, int stage)
{
    return lanes->v + first_output(&lanes->frame, stage) * (size_t)lanes->width;
}

void kmp_lanes_outputs(const kmp_lanes *lanes, int stage, kmp_lanes_output *output)
{
    const kmp_frame *f = &lanes->frame;
    size_t w = (size_t)lanes->width, first = first_output(f, stage), end = first_output(f, stage + 1);
    for (size_t slot = first; slot < end; slot++)
        output[slot - first] = (kmp_lanes_output){lanes->v + slot * w, 1};
    for (uint32_t k = f->copy_start[stage]; k < f->copy_start[stage + 1]; k++)
        output[f->copies[k].to - first] = (kmp_lanes_output){lanes->v + f->copies[k].from * w, f->copies[k].factor};
}

static bool is_twin(const kmp_lanes *lanes, uint32_t angle, uint32_t of_lender)
{
    const size_t w = (size_t)lanes->width;
    const uint32_t slot = lanes->lender->frame.angle[of_lender];
    return slot != KMP_SLOT_ONE && /* lists are padded with it */
           memcmp(lanes->v + w * lanes->frame.angle[angle], lanes->lender->v + w * slot, w * sizeof *lanes->v) == 0;
}

/* Copies the sines and cosines of a segment. False: the lender does not have all of them. */
static bool borrow(kmp_lanes *lanes, const kmp_segment *here)
{
    const size_t w = (size_t)lanes->width;
    const kmp_frame *to = &lanes->frame, *from = &lanes->lender->frame;
    const double *values = lanes->lender->v;
    for (uint32_t k = here->angle; k < here->angle + here->angles; k++) {
        uint32_t twin = lanes->twin[k];
        if (!is_twin(lanes, k, twin))
            for (twin = 0; twin < from->angles && !is_twin(lanes, k, twin);)
                twin++;
        if (twin == from->angles)
            return false;
        lanes->twin[k] = twin;
        lanes_copy(w, lanes->v + w * to->sine[k], values + w * from->sine[twin]);
        lanes_copy(w, lanes->v + w * to->cosine[k], values + w * from->cosine[twin]);
    }
    return true;
}

void kmp_lanes_run_in_place(kmp_lanes *lanes, int stage)
{
    const kmp_frame *f = &lanes->frame;
    for (uint32_t g = f->stage[stage]; g < f->stage[stage + 1]; g++) {
        const kmp_segment *here = &f->segments[g], *next = here + 1;
        run_arithmetic(lanes, g);
        const uint32_t *x = f->angle + here->angle, *s = f->sine + here->angle, *c = f->cosine + here->angle;
        if (here->angles > 0 && lanes->sincos)
            lanes->sincos(lanes->user, (int)here->angle, (int)here->angles, lanes->v, x, s, c);
        else if (here->angles > 0 && !(stage > 0 && lanes->lender && borrow(lanes, here)))
            kmp_sincos_lanes((int)here->angles, lanes->width, lanes->v, x, s, c);
        for (uint32_t i = here->special; i < next->special; i++)
            for (size_t l = 0; l < (size_t)lanes->width; l++)
                kmp_frame_special(f, &f->specials[i], lanes->v + l, (size_t)lanes->width);
    }
}

const double *kmp_lanes_run(kmp_lanes *lanes, int stage)
{
    const kmp_program *program = lanes->frame.program;
    kmp_lanes_run_in_place(lanes, stage);
    kmp_lanes_gather(lanes, stage, 0, program->outputs[stage + 1] - program->outputs[stage]);
    return kmp_lanes_values(lanes, stage);
}
