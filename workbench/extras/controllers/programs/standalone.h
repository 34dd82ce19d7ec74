/* Corrected joint positions of a calibrated arm, with all its effects, in one header that needs libc and libm.

       double q[ARM_N], left[2];
       if (arm_correct(wanted, NULL, q, left) == 0) send(q);

   Joints in rad or m; poses are 3 x 4, row by row, of the tool in the robot's base. `left` is the remaining
   error [m, rad]. A correction that would make it worse is not applied. Loads are those of the arm at rest. Each
   function returns 0, 1 if more than ARM_CLEAR is left, 2 if something that drives the arm's effects is missing.
   No memory is allocated and nothing is kept between calls. */
#ifndef ARM_KERNEL_H
#define ARM_KERNEL_H

#include <math.h>
#include <string.h>

/*DATA*/

#define ARM_CLEAR 1e-6

typedef struct {
    double payload;          /* mass at the tool [kg] */
    double temperature;      /* [degC]; NAN if unknown */
    const double *direction; /* sign of each joint's last motion; NULL if unknown */
} arm_state;

typedef struct {
    double m[12];
} arm_pose;

static void arm_multiply(const double *a, const double *b, double *out) {
    double r[12];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            r[4 * i + j] = a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] + a[4 * i + 2] * b[8 + j];
            if (j == 3) r[4 * i + j] += a[4 * i + 3];
        }
    memcpy(out, r, sizeof r);
}

static void arm_inverse(const double *a, double *out) {
    double r[12];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) r[4 * i + j] = a[4 * j + i];
        r[4 * i + 3] = -(a[i] * a[3] + a[4 + i] * a[7] + a[8 + i] * a[11]);
    }
    memcpy(out, r, sizeof r);
}

static void arm_step(double *t, int axis, double value) {
    if (axis >= 3) {
        for (int i = 0; i < 3; i++) t[4 * i + 3] += t[4 * i + axis - 3] * value;
        return;
    }
    int a = (axis + 1) % 3, b = (axis + 2) % 3;
    double c = cos(value), s = sin(value);
    for (int i = 0; i < 3; i++) {
        double x = t[4 * i + a], y = t[4 * i + b];
        t[4 * i + a] = x * c + y * s;
        t[4 * i + b] = y * c - x * s;
    }
}

static double arm_cross_dot(const double *a, const double *b, const double *c) {
    return (a[1] * b[2] - a[2] * b[1]) * c[0] + (a[2] * b[0] - a[0] * b[2]) * c[1] + (a[0] * b[1] - a[1] * b[0]) * c[2];
}

/* Frame right before every element of the chain, and behind the last one. */
static void arm_frames(const double *q, const double *shift, arm_pose *out) {
    double t[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (int k = 0; k < ARM_K; k++) {
        memcpy(out[k].m, t, sizeof t);
        if (ARM_CONSTANT[k] >= 0)
            arm_multiply(t, ARM_CONSTANTS[ARM_CONSTANT[k]], t);
        else
            arm_step(t, ARM_AXIS[k], ARM_VALUE[k] + shift[k] + (ARM_DRIVER[k] >= 0 ? q[ARM_DRIVER[k]] : 0.0));
    }
    memcpy(out[ARM_K].m, t, sizeof t);
}

static double arm_sign(double x) { return (x > 0.0) - (x < 0.0); }

static void arm_load(const arm_pose *mount, const double *point, const double *force, double *w) {
    double p[3], m[3];
    for (int i = 0; i < 3; i++) p[i] = point[i] - mount->m[4 * i + 3];
    m[0] = p[1] * force[2] - p[2] * force[1];
    m[1] = p[2] * force[0] - p[0] * force[2];
    m[2] = p[0] * force[1] - p[1] * force[0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            w[i] += mount->m[4 * j + i] * force[j];
            w[3 + i] += mount->m[4 * j + i] * m[j];
        }
}

/* What the link before each joint exerts on the link after it, at rest, in the axes of the joint's mount. */
static void arm_wrenches(const arm_pose *frames, double payload, double w[][6]) {
    for (int joint = 0; joint < ARM_N; joint++) {
        const arm_pose *mount = &frames[ARM_MOUNT[joint]];
        for (int i = 0; i < 6; i++) w[joint][i] = 0.0;
        for (int link = 0; link <= ARM_LINKS; link++) {
            int last = link == ARM_LINKS;
            const double *c = last ? NULL : ARM_COM[link];
            int at = last ? ARM_K : ARM_AFTER[link] + 1;
            if (!last && at <= ARM_MOUNT[joint]) continue;
            const double *t = frames[at].m;
            double point[3], force[3];
            for (int i = 0; i < 3; i++) {
                point[i] = t[4 * i + 3];
                if (c) point[i] += t[4 * i] * c[0] + t[4 * i + 1] * c[1] + t[4 * i + 2] * c[2];
                force[i] = -(last ? payload : ARM_MASS[link]) * ARM_GRAVITY[i];
            }
            arm_load(mount, point, force, w[joint]);
        }
    }
}

static double arm_sag(const arm_term *m, const double *q, double payload, const arm_pose *rigid) {
    int mine = ARM_DRIVEN[m->i];
    const double *f = rigid[mine + 1].m;
    double u[3], w[3];
    for (int i = 0; i < 3; i++) {
        u[i] = f[4 * i + ARM_AXIS[mine] % 3];
        if (m->k == 4) {
            w[i] = payload * (rigid[ARM_K].m[4 * i + 3] - f[4 * i + 3]);
        } else {
            int link = ARM_DRIVEN[m->j];
            int column = m->k == 3 ? ARM_AXIS[link] % 3 : m->k;
            w[i] = rigid[link + 1].m[4 * i + column] * (m->k == 3 ? q[m->j] : 1.0);
        }
    }
    return arm_cross_dot(m->direction, u, w);
}

/* Terms that no load drives. */
static double arm_still(const arm_term *m, const double *q, const arm_state *s, const arm_pose *rigid) {
    double at = q[m->i < 0 ? 0 : m->i], out;
    if (m->kind == 0) return m->a * at;
    if (m->kind == 3) return (s->temperature - m->b) * (m->a + m->c * at);
    if (m->kind == 4) return m->a * arm_sign(s->direction[m->i]);
    if (m->kind == 5) return m->a * arm_sag(m, q, s->payload, rigid);
    if (m->kind == 1) {
        out = m->a * cos(m->c * at) + m->b * sin(m->c * at);
    } else {
        const double *x = ARM_KNOTS + m->first, *p;
        double turn = 2.0 * 3.14159265358979323846, place = at;
        int piece = 0;
        if (m->c != 0.0)
            place = x[0] + (at - x[0]) - turn * floor((at - x[0]) / turn);
        else
            place = fmin(fmax(at, x[0]), x[m->pieces]);
        while (piece < m->pieces - 1 && place >= x[piece + 1]) piece++;
        p = ARM_CUBICS + 4 * (m->cubic + piece);
        place -= x[piece];
        out = ((p[0] * place + p[1]) * place + p[2]) * place + p[3];
    }
    if (m->span != 0.0) {
        double beyond = fmax(fmax(m->low - at, at - m->high), 0.0);
        out *= 0.5 * (1.0 + cos(3.14159265358979323846 * fmin(beyond / m->span, 1.0)));
    }
    return out;
}

/* Terms that loads drive. */
static double arm_loaded(const arm_term *m, const double *q, double w[][6]) {
    double load = w[m->i][m->j], other = w[m->i][m->k];
    if (m->kind == 6) return m->a * load;
    if (m->kind == 7) return m->a * (m->b != 0.0 ? tanh(load / m->b) : arm_sign(load));
    if (m->kind == 8) {
        double size = sqrt(load * load + other * other);
        return size > 0.0 ? m->a * load / size : 0.0;
    }
    return m->a * (cos(m->c + m->b * q[m->i]) * load + sin(m->c + m->b * q[m->i]) * other);
}

/* Pose of the tool, at the fixed point of loads and what they bend. */
static void arm_bent(const double *q, const arm_state *s, double *pose) {
    double shift[ARM_K] = {0.0}, start[ARM_K], fresh[ARM_K], w[ARM_N][6];
    arm_pose frames[ARM_K + 1], rigid[ARM_K + 1];
    int loads = 0;
    arm_frames(q, shift, rigid);
    for (int i = 0; i < ARM_TERMS; i++) {
        if (ARM_TERM[i].kind < 6)
            shift[ARM_TERM[i].element] += arm_still(&ARM_TERM[i], q, s, rigid);
        else
            loads = 1;
    }
    memcpy(start, shift, sizeof start);
    for (int round = 0; loads && round < 20; round++) {
        double moved = 0.0;
        arm_frames(q, shift, frames);
        arm_wrenches(frames, s->payload, w);
        memcpy(fresh, start, sizeof fresh);
        for (int i = 0; i < ARM_TERMS; i++)
            if (ARM_TERM[i].kind >= 6) fresh[ARM_TERM[i].element] += arm_loaded(&ARM_TERM[i], q, w);
        for (int k = 0; k < ARM_K; k++) moved = fmax(moved, fabs(fresh[k] - shift[k]));
        memcpy(shift, fresh, sizeof shift);
        if (moved < 1e-13) break;
    }
    arm_frames(q, shift, frames);
    memcpy(pose, frames[ARM_K].m, 12 * sizeof(double));
}

/* Tool, and direction and point of every joint, of an arm of constants between joints about (along) z. */
static void arm_geometry(const double constants[][12], const double *x, double *t, double axes[][3], double points[][3]) {
    memcpy(t, constants[0], 12 * sizeof(double));
    for (int k = 0; k < ARM_N; k++) {
        for (int i = 0; axes && i < 3; i++) {
            axes[k][i] = t[4 * i + 2];
            points[k][i] = t[4 * i + 3];
        }
        arm_step(t, ARM_SLIDES[k] ? 5 : 2, x[k]);
        arm_multiply(t, constants[k + 1], t);
    }
}

/* Position and rotation that are missing, and their lengths; returns the cost. */
static double arm_missing(const double *tool, const double *target, double *r, double *left) {
    double sine = 0.0, cosine = 1.0;
    for (int i = 0; i < 3; i++) {
        r[i] = target[4 * i + 3] - tool[4 * i + 3];
        r[3 + i] = 0.0;
    }
    left[0] = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    left[1] = 0.0;
    if (ARM_TASK != 3) {
        if (ARM_TASK == 5) {
            for (int i = 0; i < 3; i++) {
                int j = (i + 1) % 3, k = (i + 2) % 3;
                r[3 + i] = tool[4 * j + 2] * target[4 * k + 2] - tool[4 * k + 2] * target[4 * j + 2];
            }
            cosine = tool[2] * target[2] + tool[6] * target[6] + tool[10] * target[10];
        } else {
            double m[3][3], trace = 0.0;
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++)
                    m[i][j] = target[4 * i] * tool[4 * j] + target[4 * i + 1] * tool[4 * j + 1] +
                              target[4 * i + 2] * tool[4 * j + 2];
            for (int i = 0; i < 3; i++) {
                int j = (i + 1) % 3, k = (i + 2) % 3;
                trace += m[i][i];
                r[3 + i] = 0.5 * (m[k][j] - m[j][k]);
            }
            cosine = 0.5 * (trace - 1.0);
        }
        sine = sqrt(r[3] * r[3] + r[4] * r[4] + r[5] * r[5]);
        left[1] = atan2(sine, cosine);
        for (int i = 3; i < 6; i++) r[i] *= sine < 1e-300 ? 1.0 : left[1] / sine;
    }
    return left[0] * left[0] + ARM_WEIGHT * ARM_WEIGHT * left[1] * left[1];
}

/* Solve (H + damping) step = g with the held joints at rest; 0 where that breaks down. */
static int arm_solve(double h[][ARM_N], const double *g, double damping, const int *held, double *step) {
    double low[ARM_N][ARM_N];
    for (int a = 0; a < ARM_N; a++) {
        for (int b = 0; b <= a; b++) {
            double total = held[a] || held[b] ? 0.0 : h[a][b];
            if (a == b) total = held[a] ? 1.0 : total + damping;
            for (int k = 0; k < b; k++) total -= low[a][k] * low[b][k];
            if (a == b) {
                if (total <= 0.0) return 0;
                low[a][a] = sqrt(total);
            } else {
                low[a][b] = total / low[b][b];
            }
        }
    }
    for (int a = 0; a < ARM_N; a++) {
        double total = held[a] ? 0.0 : g[a];
        for (int k = 0; k < a; k++) total -= low[a][k] * step[k];
        step[a] = total / low[a][a];
    }
    for (int a = ARM_N - 1; a >= 0; a--) {
        double total = step[a];
        for (int k = a + 1; k < ARM_N; k++) total -= low[k][a] * step[k];
        step[a] = total / low[a][a];
    }
    return 1;
}

static double arm_clip(int k, double v) { return fmin(fmax(v, ARM_LIMITS[k][0]), ARM_LIMITS[k][1]); }

/* JᵀJ and Jᵀr, rotations weighted, as far as the task asks for them; returns the mean of the diagonal. */
static double arm_normal(
    const double *t, double axes[][3], double points[][3], const double *r, double h[][ARM_N], double *g
) {
    double j[ARM_N][6], size = 0.0;
    for (int k = 0; k < ARM_N; k++) {
        double along = 0.0;
        for (int i = 0; i < 3; i++) {
            int a = (i + 1) % 3, b = (i + 2) % 3;
            double x = t[4 * a + 3] - points[k][a], y = t[4 * b + 3] - points[k][b];
            j[k][i] = ARM_SLIDES[k] ? axes[k][i] : axes[k][a] * y - axes[k][b] * x;
            along += axes[k][i] * t[4 * i + 2];
        }
        for (int i = 0; i < 3; i++) {
            double turn = ARM_SLIDES[k] || ARM_TASK == 3 ? 0.0 : axes[k][i];
            if (ARM_TASK == 5 && !ARM_SLIDES[k]) turn -= along * t[4 * i + 2];
            j[k][3 + i] = turn * ARM_WEIGHT;
        }
    }
    for (int a = 0; a < ARM_N; a++) {
        g[a] = 0.0;
        for (int i = 0; i < 6; i++) g[a] += j[a][i] * r[i] * (i < 3 ? 1.0 : ARM_WEIGHT);
        for (int b = 0; b <= a; b++) {
            h[a][b] = 0.0;
            for (int i = 0; i < 6; i++) h[a][b] += j[a][i] * j[b][i];
        }
        size += h[a][a] / ARM_N;
    }
    return size;
}

/* Damped Newton of the rigid arm, until it is there or no step helps. */
static void arm_refine(const double *target, double *x) {
    double tool[12], axes[ARM_N][3], points[ARM_N][3], r[6], left[2], h[ARM_N][ARM_N], g[ARM_N], step[ARM_N];
    double relative = 1e-3, fresh[ARM_N], cost;
    int idle = 0, held[ARM_N];
    for (int k = 0; k < ARM_N; k++) x[k] = arm_clip(k, x[k]);
    arm_geometry(ARM_RIGID, x, tool, axes, points);
    cost = arm_missing(tool, target, r, left);
    for (int count = 0; count < 60 && idle < 4 && (left[0] > 1e-13 || left[1] > 1e-13); count++) {
        double size = arm_normal(tool, axes, points, r, h, g), trial = 0.0;
        int better = 0;
        for (int k = 0; k < ARM_N; k++)
            held[k] = (x[k] <= ARM_LIMITS[k][0] && g[k] < 0.0) || (x[k] >= ARM_LIMITS[k][1] && g[k] > 0.0);
        relative = fmax(fmin(relative, cost / size), 1e-11);
        for (int attempt = 0; attempt < 14 && !better; attempt++) {
            double longest = 0.0, scale;
            if (arm_solve(h, g, relative * size, held, step)) {
                for (int k = 0; k < ARM_N; k++) longest = fmax(longest, fabs(step[k]));
                scale = fmin(1.0, 0.7 / fmax(longest, 1e-300));
                for (int k = 0; k < ARM_N; k++) fresh[k] = arm_clip(k, x[k] + scale * step[k]);
                arm_geometry(ARM_RIGID, fresh, tool, axes, points);
                trial = arm_missing(tool, target, r, left);
                better = trial < cost;
            }
            if (!better) relative *= 10.0;
        }
        if (!better) return;
        idle = trial > 0.9999 * cost ? idle + 1 : 0;
        cost = trial;
        relative *= 0.1;
        memcpy(x, fresh, sizeof fresh);
    }
}

static double arm_missed(const double *pose, const double *q, const arm_state *s, double *wanted, double *left) {
    double tool[12], bent[12], r[6];
    arm_geometry(ARM_RIGID, q, tool, NULL, NULL);
    arm_bent(q, s, bent);
    arm_inverse(bent, bent);
    arm_multiply(tool, bent, wanted);
    arm_multiply(wanted, pose, wanted);
    return arm_missing(tool, wanted, r, left);
}

/* Joints with which this arm takes a pose, next to others. */
static int arm_correct_pose(
    const double *pose, const double *near, const arm_state *state, double *corrected, double *left
) {
    arm_state none = {0.0, NAN, NULL};
    const arm_state *s = state ? state : &none;
    double x[ARM_N], best[ARM_N], step[ARM_N] = {0.0}, wanted[12], before[2], miss[2], share = 1.0, cost = INFINITY, first;
    if ((ARM_WARM && isnan(s->temperature)) || (ARM_DIRECTED && !s->direction)) return 2;
    first = arm_missed(pose, near, s, wanted, before);
    for (int k = 0; k < ARM_N; k++) best[k] = x[k] = arm_clip(k, near[k]);
    for (int round = 0; round < 40 && cost > 1e-24 && share > 1.0 / 256.0; round++) {
        double here = arm_missed(pose, x, s, wanted, miss);
        if (here < cost) {
            cost = here;
            memcpy(best, x, sizeof best);
            memcpy(left, miss, sizeof miss);
            memcpy(step, x, sizeof step);
            arm_refine(wanted, step);
            for (int k = 0; k < ARM_N; k++) step[k] -= x[k];
            share = 1.0;
        } else {
            share *= 0.5;
        }
        for (int k = 0; k < ARM_N; k++) x[k] = best[k] + share * step[k];
    }
    if (cost > first || left[0] > fmax(before[0], 1e-9)) {
        memcpy(best, near, sizeof best);
        memcpy(left, before, sizeof before);
    }
    memcpy(corrected, best, sizeof best);
    return left[0] > ARM_CLEAR;
}

/* Joints with which this arm is where the nominal one would be. */
static int arm_correct(const double *wanted, const arm_state *state, double *corrected, double *left) {
    double pose[12];
    arm_geometry(ARM_NOMINAL, wanted, pose, NULL, NULL);
    return arm_correct_pose(pose, wanted, state, corrected, left);
}

/* Where this arm's tool is, bent as it is. */
static int arm_forward(const double *q, const arm_state *state, double *pose) {
    arm_state none = {0.0, NAN, NULL};
    const arm_state *s = state ? state : &none;
    if ((ARM_WARM && isnan(s->temperature)) || (ARM_DIRECTED && !s->direction)) return 2;
    arm_bent(q, s, pose);
    return 0;
}

#endif
