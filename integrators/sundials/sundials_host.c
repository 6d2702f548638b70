/* SPDX-License-Identifier: BSD-3-Clause */
/* The adapter of SUNDIALS. The formulation is asked after each step; a rejected one is repeated shorter from a copy of
 * the state, since the packages have no such callback. An integral that nothing depends on is completed by a
 * separate rule. */
#include "integrators/sundials/sundials_host.h"
#include "base/clones.h"
#include "integrators/decide/step_control.h"
#include "integrators/sundials/linear.h"
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

/* Replaces the operations of SUNDIALS' serial vector that dominate IDA's steps by vectorised ones. Sums are taken in
 * eight fixed interleaved parts, so that every vector width gives the same bits; a combination of many vectors is one
 * pass. Loops are cloned by width like the loops of sines (src/backend/sincos.c). All other operations are SUNDIALS'
 * own. */

enum { LANES = 8 };

/* -- loops -------------------------------------------------------------------------------------------- */

/* z = a x + b y; z may be x or y */
KMP_CLONES static void sum(ptrdiff_t n, double a, const double *x, double b, const double *y, double *z)
{
    for (ptrdiff_t i = 0; i < n; i++)
        z[i] = a * x[i] + b * y[i];
}

/* z = a x; z may be x */
KMP_CLONES static void scale(ptrdiff_t n, double a, const double *x, double *z)
{
    for (ptrdiff_t i = 0; i < n; i++)
        z[i] = a * x[i];
}

static double square(double x, double w)
{
    return x * w * (x * w);
}

/* Sum of the squares of x w, over entries with positive `mask` (NULL: all). */
static KMP_INTO_CLONES double sum_squares(ptrdiff_t n, const double *x, const double *w, const double *mask)
{
    double part[LANES] = {0};
    ptrdiff_t whole = n - n % LANES;
    for (ptrdiff_t i = 0; i < whole; i += LANES)
        for (int k = 0; k < LANES; k++)
            part[k] += !mask || mask[i + k] > 0 ? square(x[i + k], w[i + k]) : 0;
    for (ptrdiff_t i = whole; i < n; i++)
        part[i - whole] += !mask || mask[i] > 0 ? square(x[i], w[i]) : 0;
    return ((part[0] + part[4]) + (part[2] + part[6])) + ((part[1] + part[5]) + (part[3] + part[7]));
}

KMP_CLONES static double squares(ptrdiff_t n, const double *x, const double *w)
{
    return sum_squares(n, x, w, NULL);
}

KMP_CLONES static double squares_where(ptrdiff_t n, const double *x, const double *w, const double *mask)
{
    return sum_squares(n, x, w, mask);
}

/* z = sum of a[k] x[k] over count >= 1 vectors; z may be any of them */
KMP_CLONES static void combination(ptrdiff_t n, int count, const double *a, const double *const *x, double *z)
{
    ptrdiff_t whole = n - n % LANES;
    for (ptrdiff_t i = 0; i < whole; i += LANES) {
        double part[LANES];
        for (int k = 0; k < LANES; k++)
            part[k] = a[0] * x[0][i + k];
        for (int v = 1; v < count; v++)
            for (int k = 0; k < LANES; k++)
                part[k] += a[v] * x[v][i + k];
        for (int k = 0; k < LANES; k++)
            z[i + k] = part[k];
    }
    for (ptrdiff_t i = whole; i < n; i++) {
        double one = a[0] * x[0][i];
        for (int v = 1; v < count; v++)
            one += a[v] * x[v][i];
        z[i] = one;
    }
}

/* -- callbacks of SUNDIALS ----------------------------------------------------------------------------- */

static ptrdiff_t length_of(N_Vector x)
{
    return (ptrdiff_t)NV_LENGTH_S(x);
}

static void linear_sum(double a, N_Vector x, double b, N_Vector y, N_Vector z)
{
    sum(length_of(x), a, NV_DATA_S(x), b, NV_DATA_S(y), NV_DATA_S(z));
}

static void scaled(double a, N_Vector x, N_Vector z)
{
    if (a == 1 && x == z)
        return;
    scale(length_of(x), a, NV_DATA_S(x), NV_DATA_S(z));
}

static double norm(N_Vector x, N_Vector w)
{
    return sqrt(squares(length_of(x), NV_DATA_S(x), NV_DATA_S(w)) / (double)length_of(x));
}

static double norm_where(N_Vector x, N_Vector w, N_Vector mask)
{
    return sqrt(squares_where(length_of(x), NV_DATA_S(x), NV_DATA_S(w), NV_DATA_S(mask)) / (double)length_of(x));
}

/* More vectors than this are combined in parts; no integrator has this number. */
enum { MOST = 16 };

static int linear_combination(int count, double *a, N_Vector *x, N_Vector z)
{
    const double *from[MOST + 1] = {NULL};
    double factor[MOST + 1];
    for (int done = 0; done < count;) {
        int more = 0;
        if (done > 0) { /* the sum so far */
            factor[more] = 1;
            from[more++] = NV_DATA_S(z);
        }
        for (; done < count && more <= MOST; done++) {
            factor[more] = a[done];
            from[more++] = NV_DATA_S(x[done]);
        }
        combination(length_of(z), more, factor, from, NV_DATA_S(z));
    }
    return 0;
}

N_Vector kmp_vector_new(sunindextype n, SUNContext context)
{
    N_Vector v = N_VNew_Serial(n, context);
    if (!v)
        return NULL;
    v->ops->nvlinearsum = linear_sum;
    v->ops->nvscale = scaled;
    v->ops->nvwrmsnorm = norm;
    v->ops->nvwrmsnormmask = norm_where;
    v->ops->nvlinearcombination = linear_combination;
    return v;
}

/* Largest number of attempts at one step with smaller sizes. */
enum { MAX_TRIES = 100 };

/* Steps of a multistep method whose integral is computed closely, and one in 32 further ones: the work of
 * forces is a check of a run. Steps of one-step methods cost several times as much. */
enum { SPENT = 128 };

/* Parts of an integral: by which two rules for one step may differ, and the ones that a bend of the integrand may have.
 */
static const double INTEGRAL = 1e-5, BEND = 1e-4;

static void put(const kmp_sun *s, N_Vector to, const double *from)
{
    memcpy(kmp_sun_data(to), from, (size_t)s->n * sizeof *from);
}

static void get(const kmp_sun *s, N_Vector from, double *to)
{
    memcpy(to, kmp_sun_data(from), (size_t)s->n * sizeof *to);
}

/* -- creation -------------------------------------------------------------------------------------- */

void kmp_sun_put_pattern(const kmp_dae *dae, SUNMatrix a)
{
    _Static_assert(sizeof(sunindextype) == sizeof *dae->col_start && sizeof(sunindextype) == sizeof *dae->row,
                   "the patterns have the indices of SUNDIALS");
    memcpy(SUNSparseMatrix_IndexPointers(a), dae->col_start, ((size_t)dae->n + 1) * sizeof *dae->col_start);
    memcpy(SUNSparseMatrix_IndexValues(a), dae->row, (size_t)dae->nz * sizeof *dae->row);
}

void *kmp_sun_create(const kmp_solver_kind *kind, const kmp_solver_setup *setup)
{
    if (kind->dae && !kmp_linear_find(setup->linear)) {
        (void)kmp_fail(setup->context, KEMPE_E_ARGUMENT, "unknown linear solver '%s'", setup->linear);
        return NULL;
    }
    int bad = 0;
    kmp_sun *s = kmp_solver_new(kind, setup, sizeof *s);
    if (!s)
        return NULL;
    s->kind = kind;
    s->package = kind->method;
    s->n = kind->dae ? s->base.dae.n : s->base.ode.n;
    s->sun = kmp_sun_context();
    N_Vector (*make)(sunindextype, SUNContext) = kind->dae ? kmp_vector_new : N_VNew_Serial;
    bool made = s->sun && (s->y = make(s->n, s->sun)) && (s->out = make(s->n, s->sun)) &&
                (!kind->dae || (s->yp = make(s->n, s->sun))) &&
                KMP_ARENA_MAKE(&s->base.arena, KMP_ROOM(double, s->n, &s->y_old, &s->yp_old, &s->dy, &s->w),
                               KMP_ROOM(double, 2 * (KMP_SUN_MOST_DEGREE + 1) * s->n, &s->node));
    if (made)
        put(s, s->y, s->y_old); /* zeros */
    if (made && s->yp)
        put(s, s->yp, s->yp_old);
    bool solves = kind->dae || kind->implicit;
    if (made && solves)
        s->matrix = kind->dae ? SUNSparseMatrix(s->n, s->n, s->base.dae.nz, CSC_MAT, s->sun)
                              : SUNDenseMatrix(s->n, s->n, s->sun);
    if (s->matrix && kind->dae)
        kmp_sun_put_pattern(&s->base.dae, s->matrix);
    if (s->matrix)
        s->linear =
            kind->dae ? kmp_linear_new(setup->linear, s->matrix, s->sun) : SUNLinSol_Dense(s->y, s->matrix, s->sun);
    if (made && (!solves || s->linear))
        bad = s->package->configure(s);
    if (s->memory && !bad)
        return s;
    if (bad)
        (void)kmp_fail(setup->context, KEMPE_E_BUG, "%s rejected its settings (flag %d)", s->package->name, bad);
    else
        (void)kmp_fail_memory(setup->context);
    kmp_sun_release(s);
    return NULL;
}

void kmp_sun_release(void *solver)
{
    kmp_sun *s = solver;
    if (!s)
        return;
    s->package->release(&s->memory);
    (void)SUNNonlinSolFree(s->iteration);
    (void)SUNLinSolFree(s->linear);
    SUNMatDestroy(s->matrix);
    N_VDestroy(s->y);
    N_VDestroy(s->yp);
    N_VDestroy(s->out);
    kmp_sun_controller_free(s->controller);
    (void)SUNContext_Free(&s->sun);
    kmp_solver_free(s);
}

/* -- callbacks ------------------------------------------------------------------------------------- */

int kmp_sun_rhs(sunrealtype t, N_Vector y, N_Vector dy, void *user)
{
    kmp_sun *s = user;
    s->base.work.rhs = ++s->more.rhs; /* includes evaluations of an interpolant between two steps */
    int said = s->base.ode.rhs(s->base.ode.self, t, kmp_sun_data(y), kmp_sun_data(dy));
    s->integral.t = t;
    s->integral.rate = kmp_sun_data(dy)[s->n - 1];
    if (isnan(s->integral.node[4]) && t == s->base.t)
        s->integral.node[4] = s->integral.rate;
    s->halted = s->halted || said == KMP_HALT;
    return said;
}

int kmp_sun_jacobian(sunrealtype t, N_Vector y, N_Vector dy, SUNMatrix j, void *user, N_Vector w1, N_Vector w2,
                     N_Vector w3)
{
    (void)dy, (void)w1, (void)w2, (void)w3;
    kmp_sun *s = user;
    SUNMatZero(j);
    int said = s->base.ode.jacobian(s->base.ode.self, t, kmp_sun_data(y), SUNDenseMatrix_Data(j));
    s->halted = s->halted || said == KMP_HALT;
    return said;
}

N_Vector kmp_sun_atol(kmp_sun *s)
{
    put(s, s->out, s->base.tolerance.atol);
    return s->out;
}

/* -- failures and counters ------------------------------------------------------------------------- */

/* The row of a flag, or the last one, which has no text. */
static const kmp_sun_flag *row_of(const kmp_sun *s, int flag)
{
    const kmp_sun_flag *row = s->package->flags;
    while (row->meaning && row->flag != flag)
        row++;
    return row;
}

static kempe_status complain(const kmp_sun *s, int flag)
{
    if (s->halted) /* the formulation has its own reason */
        return KEMPE_E_FAILED;
    const char *meaning = row_of(s, flag)->meaning;
    char *name = s->package->flag_name(flag);
    kempe_status status = kmp_fail(s->base.context, KEMPE_E_FAILED, "%s stopped at t = %.9g: %s (%s)", s->package->name,
                                   s->base.t, meaning ? meaning : "an unexpected failure", name);
    free(name);
    return status;
}

/* Work over all starts. */
static kmp_solver_work count(const kmp_sun *s)
{
    kmp_solver_work w = s->more;
    long own[KMP_SUN_COUNTERS] = {0};
    int readable = s->linear ? KMP_SUN_COUNTERS : KMP_SUN_COUNTERS - 2; /* the last two are of linear solvers */
    for (int k = 0; k < readable; k++)
        if (s->counter[k])
            (void)s->counter[k](s->memory, &own[k]);
    w.steps += own[0];
    w.rejected += own[1];
    w.refused += own[2];
    w.rhs += own[3];
    w.newton += own[4];
    w.matrices += own[5];
    w.factorizations += own[6];
    return w;
}

/* -- steps ----------------------------------------------------------------------------------------- */

/* Restarts from (t, y[, y']) with a first step h; 0: the package's own choice, negative: its present one. `anew`: the
 * whole history is discarded, even if the package could keep a part. */
static int restart(kmp_sun *s, bool anew, const double *y, const double *yp, double h)
{
    const kmp_sun_package *package = s->package;
    int bad;
    put(s, s->y, y);
    if (s->yp && yp)
        put(s, s->yp, yp);
    if (anew || !package->reset) {
        s->more = count(s);
        bad = package->begin(s, s->base.t);
    } else {
        bad = package->reset(s->memory, s->base.t, s->y);
    }
    bad = bad || h < 0 ? bad : package->set_first_step(s->memory, h);
    return bad || !(s->base.t_end > s->base.t) ? bad : package->set_end(s->memory, s->base.t_end);
}

kempe_status kmp_sun_start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    kmp_sun *s = solver;
    kmp_solver_begin(&s->base, t, t_end, 0);
    s->halted = s->moved = false;
    s->integral.node[4] = s->integral.t = NAN;
    s->integral.h = 0;
    s->integral.given = y[s->n - 1];
    int bad = restart(s, true, y, yp, h0);
    s->base.work = count(s);
    return bad ? complain(s, bad) : KEMPE_OK;
}

kempe_status kmp_sun_extend(void *solver, double t_end)
{
    kmp_sun *s = solver;
    s->base.t_end = t_end;
    int bad = t_end > s->base.t ? s->package->set_end(s->memory, t_end) : 0;
    return bad ? complain(s, bad) : KEMPE_OK;
}

/* Asks the formulation to accept the step that ended at t; its correction of y, for an ODE, is left in out. */
static int consent(kmp_sun *s, double t)
{
    double *y = kmp_sun_data(s->out);
    int said = KMP_GO;
    if (s->base.dae.accept)
        said = s->base.dae.accept(s->base.dae.self, t, kmp_sun_data(s->y), kmp_sun_data(s->yp));
    if (!s->kind->dae)
        get(s, s->y, y);
    if (s->base.ode.accept) {
        s->more.rhs++;
        said = s->base.ode.rhs(s->base.ode.self, t, y, s->dy);
        for (int i = 0; i < s->n; i++)
            s->w[i] = s->base.tolerance.atol[i] + s->base.tolerance.rtol * fmax(fabs(s->y_old[i]), fabs(y[i]));
        if (said == KMP_GO)
            said = s->base.ode.accept(s->base.ode.self, t, y, s->dy, s->w);
    }
    s->halted = s->halted || said == KMP_HALT;
    return said;
}

/* True if the last of y is an integral on which nothing depends, and whose error the package does not control: steps
 * are chosen only by the motion, and Newton's method leaves its value as soon as the motion has converged. */
static bool integrates(const kmp_sun *s)
{
    return !s->kind->dae && !s->kind->corrects && s->base.ode.quadratures == 1;
}

/* The integrand at t, where s->out has y; the last evaluation if it was there. */
static double integrand(kmp_sun *s, double t)
{
    if (fabs(s->integral.t - t) <= 4 * kmp_step_least(t))
        return s->integral.rate;
    s->more.rhs++;
    return s->base.ode.rhs(s->base.ode.self, t, kmp_sun_data(s->out), s->dy) == KMP_GO ? s->dy[s->n - 1] : NAN;
}

/* Nodes of the integrand in a step: the ends, and Gauss's three points between them with their weights. */
static const double nodes[] = {0, 0.1127016653792583, 0.5, 0.8872983346207417, 1},
                    weights[] = {5. / 18, 8. / 18, 5. / 18};

/* Completes the integral of the step up to t. The package's value is kept where the integrand is nearly straight, and
 * the parabola through its values at the ends of the last two steps gives the same; otherwise the package's polynomial
 * is integrated. */
static void integrate(kmp_sun *s, double t)
{
    const double from = s->base.t, h = t - from, k = s->integral.h;
    double *y = kmp_sun_data(s->y), *node = s->integral.node, part = y[s->n - 1] - s->integral.given, bend = 0;
    s->integral.given = y[s->n - 1];
    s->integral.before = node[0];
    get(s, s->y, kmp_sun_data(s->out));
    const double last = integrand(s, t);
    put(s, s->out, s->y_old);
    s->integral.t = NAN;
    node[0] = isnan(node[4]) ? integrand(s, from) : node[4];
    node[4] = last;
    if (k > 0.1 * h)
        bend = h * h * h / 6 * ((node[4] - node[0]) / h - (node[0] - s->integral.before) / k) / (h + k);
    const double rule = h * (node[0] + node[4]) / 2 - bend;
    s->integral.h = h;
    s->integral.size += fabs(rule);
    const double size = s->integral.size + 0.01 * fmax(fabs(node[0]), fabs(node[4])) * (s->base.t_end - from);
    const bool agree = fabs(part - rule) <= INTEGRAL * size && fabs(bend) <= BEND * size;
    s->integral.close = !agree && (s->package->reset || s->integral.spent <= SPENT + ++s->integral.steps / 32);
    if (!agree && (s->linear || !(k > 0.1 * h))) /* Newton's method has not converged for it, or its order is one */
        part = rule;
    s->integral.spent += s->integral.close;
    for (int i = 0; s->integral.close && i < 3; i++) {
        const double at = from + h * nodes[i + 1];
        part = i > 0 ? part : 0;
        s->integral.t = NAN;
        node[i + 1] = s->package->derivative(s->memory, at, 0, s->out) ? NAN : integrand(s, at);
        part += h * weights[i] * node[i + 1];
    }
    s->integral.t = NAN;
    s->integral.close = s->integral.close && !isnan(part);
    y[s->n - 1] = s->y_old[s->n - 1] + (isnan(part) ? rule : part);
}

/* 0 with the new state at *t, 1 to try a shorter step of relative size *shorter, negative to give up. */
static int attempt(kmp_sun *s, double *t, double *shorter)
{
    int flag = s->package->advance(s, t);
    *shorter = flag < 0 ? 0.25 : 0.5;
    if (flag < 0)
        return row_of(s, flag)->shorter && !s->halted ? KMP_RETRY : flag;
    int said = consent(s, *t);
    if (said == KMP_RETRY)
        return said;
    /* The formulation's corrections are delayed until the next step: they discard the interpolant. */
    size_t size = (size_t)s->n * sizeof(double);
    s->moved = s->kind->corrects && memcmp(kmp_sun_data(s->y), kmp_sun_data(s->out), size) != 0;
    if (s->moved)
        memcpy(kmp_sun_data(s->y), kmp_sun_data(s->out), size);
    if (integrates(s))
        integrate(s, *t);
    s->base.t_old = s->base.t;
    s->base.t = *t;
    return said;
}

/* The length of the next step; infinite if it need not be known. */
static double planned(const kmp_sun *s)
{
    double h = 0, left = s->base.t_end - s->base.t;
    if (!s->package->planned)
        return INFINITY;
    (void)s->package->planned(s->memory, &h);
    return h > 0 ? fmin(h, left) : 1e-3 * left;
}

static kempe_status make_step(kmp_sun *s)
{
    double t = s->base.t, shorter;
    get(s, s->y, s->y_old);
    if (s->yp)
        get(s, s->yp, s->yp_old);
    int bad = s->moved ? restart(s, false, s->y_old, s->yp_old, -1) : 0;
    s->moved = false;
    double h = planned(s), most = h;
    for (int tries = 0; bad == 0 && tries < MAX_TRIES; tries++) {
        bad = attempt(s, &t, &shorter);
        if (bad == 0 && !kmp_step_collapsed(&s->base.hopeless, s->base.t - s->base.t_old, s->base.t))
            return KEMPE_OK;
        if (bad == 0)
            return kmp_fail(s->base.context, KEMPE_E_FAILED, "%s stopped at t = %.9g: " KMP_SOLVER_COLLAPSED,
                            s->package->name, s->base.t);
        if (bad < 0)
            break;
        h = shorter * (t > s->base.t ? fmin(most, t - s->base.t) : h);
        most = s->package->planned ? h : INFINITY;
        s->more.refused++;
        s->more.steps -= t > s->base.t;
        bad = h > kmp_step_least(s->base.t) ? restart(s, false, s->y_old, s->yp_old, h) : s->package->refused;
        t = s->base.t;
    }
    return complain(s, bad ? bad : s->package->refused);
}

kempe_status kmp_sun_step(void *solver)
{
    kmp_sun *s = solver;
    kempe_status status = s->base.t < s->base.t_end ? make_step(s) : KEMPE_OK;
    s->base.work = count(s);
    return status;
}

void kmp_sun_undo(void *solver, double h)
{
    kmp_sun *s = solver;
    if (!kmp_solver_take_back(&s->base, h))
        return;
    s->more.steps--;
    s->more.refused++;
    s->moved = false;
    s->integral.node[4] = s->integral.t = NAN;
    s->integral.h = 0;
    s->integral.given = s->y_old[s->n - 1];
    s->halted = restart(s, false, s->y_old, NULL, h) != 0; /* the next step then fails */
}

/* -- dense output ---------------------------------------------------------------------------------- */

/* Chebyshev's nodes of a step; their number. */
static int place_nodes(const kmp_sun *s, double *at)
{
    int count = s->degree + 1;
    for (int j = 0; j < count; j++)
        at[j] = s->base.t_old + (s->base.t - s->base.t_old) * 0.5 * (1 - cos((j + 0.5) * acos(-1.0) / count));
    return count;
}

/* The integrand at part x of the last step, by the polynomial through its values at all nodes. */
static double integrand_within(const kmp_sun *s, double x)
{
    double sum = 0;
    for (int i = 0; i < 5; i++) {
        double weight = 1;
        for (int j = 0; j < 5; j++)
            weight *= i == j ? 1 : (x - nodes[j]) / (nodes[i] - nodes[j]);
        sum += weight * s->integral.node[i];
    }
    return sum;
}

/* Puts the integral at t within the last step into y: of that polynomial, or a cubic through its values and integrands
 * at both ends. */
static void place_integral(const kmp_sun *s, double t, double *y)
{
    const double h = s->base.t - s->base.t_old, x = (t - s->base.t_old) / h, *node = s->integral.node;
    const double old = s->y_old[s->n - 1], all = kmp_sun_data(s->y)[s->n - 1] - old;
    if (!integrates(s))
        return;
    double part =
        x * (h * node[0] + x * (3 * all - h * (2 * node[0] + node[4]) + x * (h * (node[0] + node[4]) - 2 * all)));
    for (int i = 0; s->integral.close && i < 3; i++)
        part = (i > 0 ? part : 0) + x * h * weights[i] * integrand_within(s, x * nodes[i + 1]);
    y[s->n - 1] = old + part;
}

/* Component k (y or yp) of a received step by Lagrange's polynomials of its nodes. */
static void interpolate(const kmp_sun *s, double t, int k, double *to)
{
    double at[KMP_SUN_MOST_DEGREE + 1];
    int count = place_nodes(s, at);
    memset(to, 0, (size_t)s->n * sizeof *to);
    for (int j = 0; j < count; j++) {
        const double *y = s->node + (size_t)(k * count + j) * (size_t)s->n;
        double weight = 1;
        for (int l = 0; l < count; l++)
            weight *= l == j ? 1 : (t - at[l]) / (at[j] - at[l]);
        for (int i = 0; i < s->n; i++)
            to[i] += weight * y[i];
    }
}

kempe_status kmp_sun_dense(void *solver, double t, double *y, double *yp)
{
    kmp_sun *s = solver;
    bool at_end = t == s->base.t || !(s->base.t > s->base.t_old);
    double slack = 1e-12 * (fabs(s->base.t) + s->base.t - s->base.t_old); /* rounding */
    N_Vector end[] = {s->y, s->yp};
    double *to[] = {y, yp};
    for (int k = 0; k < 2 && end[k] && to[k]; k++) {
        if (!at_end && s->received) {
            interpolate(s, t, k, to[k]);
            continue;
        }
        if (!at_end &&
            (t < s->base.t_old - slack || t > s->base.t + slack || s->package->derivative(s->memory, t, k, s->out)))
            return kmp_fail(s->base.context, KEMPE_E_BUG, "%s has no value at t = %.9g: its last step is %.9g to %.9g",
                            s->package->name, t, s->base.t_old, s->base.t);
        get(s, at_end ? end[k] : s->out, to[k]);
        if (!at_end)
            place_integral(s, t, to[k]);
    }
    return KEMPE_OK;
}

/* The package's history stays with it: a step is transferred by its values at as many nodes as its degree needs. */
void kmp_sun_transfer(void *solver, kmp_number_stream *stream)
{
    kmp_sun *s = solver;
    N_Vector end[] = {s->y, s->yp};
    double degree = KMP_SUN_DEGREE, at[KMP_SUN_MOST_DEGREE + 1];
    s->received = stream->back;
    if (!stream->back && s->package->degree && s->package->degree(s->memory, &s->degree) == 0)
        degree = s->degree;
    kmp_solver_transfer_times(&s->base, stream);
    kmp_stream_numbers(stream, 1, &degree);
    s->degree = (int)degree;
    int count = s->base.t > s->base.t_old ? place_nodes(s, at) : 0;
    for (int k = 0; k < 2 && end[k]; k++) {
        kmp_stream_numbers(stream, s->n, kmp_sun_data(end[k]));
        for (int j = 0; j < count; j++) {
            double *node = s->node + (size_t)(k * count + j) * (size_t)s->n;
            if (stream->at && !stream->back && s->package->derivative(s->memory, at[j], k, s->out) == 0)
                get(s, s->out, node);
            if (stream->at && !stream->back)
                place_integral(s, at[j], node);
            kmp_stream_numbers(stream, s->n, node);
        }
    }
}
