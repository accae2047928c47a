
/* ---- functions ------------------------------------------------------------------------------------------------- */

static void add_product(int rows, int columns, double factor, const double *matrix, const double *x, double *y)
{
    int i, j;
    for (i = 0; i < rows; i++)
        for (j = 0; j < columns; j++)
            y[i] += factor * matrix[i * columns + j] * x[j];
}

static void set_zero(int n, double *y)
{
    int i;
    for (i = 0; i < n; i++)
        y[i] = 0.0;
}

void model_rate(const double *x, const double *u, double *x_rate)
{
    set_zero(MODEL_STATES, x_rate);
    add_product(MODEL_STATES, MODEL_STATES, 1.0, model_A, x, x_rate);
    add_product(MODEL_STATES, MODEL_INPUTS, 1.0, model_B, u, x_rate);
}

void model_output(const double *x, const double *u, double *y)
{
    int i;
    for (i = 0; i < MODEL_OUTPUTS; i++)
        y[i] = model_y0[i];
    add_product(MODEL_OUTPUTS, MODEL_STATES, 1.0, model_C, x, y);
    add_product(MODEL_OUTPUTS, MODEL_INPUTS, 1.0, model_D, u, y);
}

/* exp of h [A B; 0 0] by scaling and squaring of its series; the states are scaled by model_scale meanwhile */
void model_discretise(double h, double *transition, double *input, double *work)
{
    enum { N = MODEL_STATES, M = MODEL_INPUTS, W = MODEL_STATES + MODEL_INPUTS, TERMS = 18 };
    double *wide = work, *term = work + W * W, *sum = work + 2 * W * W, *product = work + 3 * W * W;
    double norm = 0.0, row, factor = 1.0;
    int i, j, k, l, squarings = 0;
    for (i = 0; i < W; i++) {
        row = 0.0;
        for (j = 0; j < W; j++) {
            double value = 0.0;
            if (i < N)
                value = j < N ? model_A[i * N + j] * model_scale[j] : model_B[i * M + j - N];
            wide[i * W + j] = i < N ? h * value / model_scale[i] : 0.0;
            row += wide[i * W + j] < 0.0 ? -wide[i * W + j] : wide[i * W + j];
        }
        norm = row > norm ? row : norm;
    }
    while (norm * factor > 0.5 && squarings < 1000) {
        factor *= 0.5;
        squarings++;
    }
    for (i = 0; i < W * W; i++) {
        wide[i] *= factor;
        term[i] = sum[i] = i % (W + 1) == 0 ? 1.0 : 0.0;
    }
    for (k = 1; k <= TERMS + squarings; k++) {
        double *left = k <= TERMS ? term : sum, *right = k <= TERMS ? wide : sum;
        set_zero(W * W, product);
        for (i = 0; i < W; i++)
            for (l = 0; l < W; l++)
                if (left[i * W + l] != 0.0)
                    for (j = 0; j < W; j++)
                        product[i * W + j] += left[i * W + l] * right[l * W + j];
        for (i = 0; i < W * W; i++) {
            if (k <= TERMS)
                sum[i] += term[i] = product[i] / k;
            else
                sum[i] = product[i];
        }
    }
    for (i = 0; i < N; i++) {
        for (j = 0; j < N; j++)
            transition[i * N + j] = sum[i * W + j] * model_scale[i] / model_scale[j];
        for (j = 0; j < M; j++)
            input[i * M + j] = sum[i * W + N + j] * model_scale[i];
    }
}

void model_step(const double *transition, const double *input, const double *u, double *x)
{
    double after[MODEL_STATES + 1];
    int i;
    set_zero(MODEL_STATES, after);
    add_product(MODEL_STATES, MODEL_STATES, 1.0, transition, x, after);
    add_product(MODEL_STATES, MODEL_INPUTS, 1.0, input, u, after);
    for (i = 0; i < MODEL_STATES; i++)
        x[i] = after[i];
}
