
/* Responses to a unit step of every input in turn, by model_step, against those that femflex computed. */
int main(void)
{
    static double transition[MODEL_STATES * MODEL_STATES + 1], input[MODEL_STATES * MODEL_INPUTS + 1];
    static double work[MODEL_WORK], x[MODEL_STATES + 1], u[MODEL_INPUTS + 1], y[MODEL_OUTPUTS + 1];
    double largest = 0.0;
    int i, j, k;
    model_discretise(STEP, transition, input, work);
    for (j = 0; j < MODEL_INPUTS; j++) {
        for (i = 0; i < MODEL_STATES; i++)
            x[i] = 0.0;
        for (i = 0; i < MODEL_INPUTS; i++)
            u[i] = i == j ? 1.0 : 0.0;
        for (k = 0; k < STEPS; k++) {
            model_step(transition, input, u, x);
            model_output(x, u, y);
            for (i = 0; i < MODEL_OUTPUTS; i++) {
                double error = fabs(y[i] - expected[(j * STEPS + k) * MODEL_OUTPUTS + i]);
                if (!(error <= largest * size[j * MODEL_OUTPUTS + i]))
                    largest = error / size[j * MODEL_OUTPUTS + i];
            }
        }
    }
    printf("largest difference of the step responses, relative to their size: %.2e\n", largest);
    printf(largest < LIMIT ? "passed\n" : "failed: expected at most %.0e\n", LIMIT);
    return largest < LIMIT ? 0 : 1;
}
