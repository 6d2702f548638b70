/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/sundials_ode.h"

#include "base/memory.h"

#include <math.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

static bool make_vectors(kmp_sun_ode *s)
{
    int n = s->ode.n;
    s->y = N_VNew_Serial(n, s->sun);
    s->atol = N_VNew_Serial(n, s->sun);
    s->out = N_VNew_Serial(n, s->sun);
    s->y_old = KMP_NEW(double, n);
    s->dy = KMP_NEW(double, n);
    s->w = KMP_NEW(double, n);
    return s->y && s->atol && s->out && s->y_old && s->dy && s->w;
}

bool kmp_sun_ode_init(kmp_sun_ode *s, const kmp_solver_setup *setup, bool implicit)
{
    s->context = setup->context;
    s->ode = *setup->ode;
    s->tolerance = setup->tolerance;
    s->sun = kmp_sun_context();
    if (!s->sun || !make_vectors(s))
        return false;
    memcpy(kmp_sun_data(s->atol), setup->tolerance.atol, (size_t)s->ode.n * sizeof(double));
    N_VConst(0.0, s->y);
    if (!implicit)
        return true;
    s->matrix = SUNDenseMatrix(s->ode.n, s->ode.n, s->sun);
    s->linear = s->matrix ? SUNLinSol_Dense(s->y, s->matrix, s->sun) : NULL;
    return s->linear;
}

void kmp_sun_ode_free(kmp_sun_ode *s)
{
    N_Vector vectors[] = {s->y, s->atol, s->out};
    if (s->linear)
        SUNLinSolFree(s->linear);
    if (s->matrix)
        SUNMatDestroy(s->matrix);
    for (int i = 0; i < 3; i++)
        if (vectors[i])
            N_VDestroy(vectors[i]);
    if (s->sun)
        SUNContext_Free(&s->sun);
    kmp_free(s->y_old);
    kmp_free(s->dy);
    kmp_free(s->w);
}

void kmp_sun_ode_begin(kmp_sun_ode *s, double t, const double *y, double t_end)
{
    s->t = s->t_old = t;
    s->t_end = t_end;
    s->halted = false;
    s->hopeless = 0;
    memcpy(kmp_sun_data(s->y), y, (size_t)s->ode.n * sizeof *y);
    memcpy(s->y_old, y, (size_t)s->ode.n * sizeof *y);
}

/* -- callbacks ------------------------------------------------------------------------------------- */

int kmp_sun_rhs(sunrealtype t, N_Vector y, N_Vector dy, void *user)
{
    kmp_sun_ode *s = user;
    s->work.rhs++;
    int said = s->ode.rhs(s->ode.self, t, kmp_sun_data(y), kmp_sun_data(dy));
    s->halted = s->halted || said == KMP_HALT;
    return said;
}

int kmp_sun_jacobian(sunrealtype t, N_Vector y, N_Vector dy, SUNMatrix j, void *user, N_Vector w1, N_Vector w2,
                     N_Vector w3)
{
    (void)dy;
    (void)w1;
    (void)w2;
    (void)w3;
    kmp_sun_ode *s = user;
    SUNMatZero(j);
    int said = s->ode.jacobian(s->ode.self, t, kmp_sun_data(y), SUNDenseMatrix_Data(j));
    s->halted = s->halted || said == KMP_HALT;
    return said;
}

int kmp_sun_accept(kmp_sun_ode *s, double t, double *y)
{
    if (!s->ode.accept)
        return KMP_GO;
    s->work.rhs++;
    int said = s->ode.rhs(s->ode.self, t, y, s->dy);
    for (int i = 0; i < s->ode.n; i++)
        s->w[i] = s->tolerance.atol[i] + s->tolerance.rtol * fmax(fabs(s->y_old[i]), fabs(y[i]));
    if (said == KMP_GO)
        said = s->ode.accept(s->ode.self, t, y, s->dy, s->w);
    s->halted = s->halted || said == KMP_HALT;
    return said;
}

kmp_solver_work kmp_sun_sum(kmp_solver_work a, kmp_solver_work b)
{
    return (kmp_solver_work){.steps = a.steps + b.steps,
                             .rejected = a.rejected + b.rejected,
                             .refused = a.refused + b.refused,
                             .rhs = a.rhs + b.rhs,
                             .newton = a.newton + b.newton,
                             .matrices = a.matrices + b.matrices,
                             .factorizations = a.factorizations + b.factorizations};
}

/* -- failures -------------------------------------------------------------------------------------- */

kempe_status kmp_sun_complain(kmp_sun_ode *s, const char *name, const char *meaning, const char *flag)
{
    if (s->halted)
        return KEMPE_E_FAILED;
    return kmp_fail(s->context, KEMPE_E_FAILED, "%s stopped at t = %.9g: %s (%s)", name, s->t, meaning, flag);
}

bool kmp_sun_progress(kmp_sun_ode *s, const char *name)
{
    if (!kmp_solver_collapsed(&s->hopeless, s->t - s->t_old, s->t))
        return true;
    (void)kmp_sun_complain(s, name, KMP_SOLVER_COLLAPSED, "collapse");
    return false;
}

/* -- behind the socket ----------------------------------------------------------------------------- */

double kmp_sun_t(const void *solver)
{
    return ((const kmp_sun_ode *)solver)->t;
}

double kmp_sun_t_old(const void *solver)
{
    return ((const kmp_sun_ode *)solver)->t_old;
}

/* Up to rounding. */
static bool is_within(const kmp_sun_ode *s, double t)
{
    double slack = 1e-12 * (fabs(s->t) + s->t - s->t_old);
    return t >= s->t_old - slack && t <= s->t + slack;
}

kempe_status kmp_sun_dense(kmp_sun_ode *s, const char *name, double t, double *y, int (*into_out)(void *s, double t))
{
    bool at_end = t == s->t || !(s->t > s->t_old);
    if (!at_end && (!is_within(s, t) || into_out(s, t)))
        return kmp_fail(s->context, KEMPE_E_BUG, "%s has no value at t = %.9g: its last step is %.9g to %.9g", name, t,
                        s->t_old, s->t);
    memcpy(y, kmp_sun_data(at_end ? s->y : s->out), (size_t)s->ode.n * sizeof *y);
    return KEMPE_OK;
}
