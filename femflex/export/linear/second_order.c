
/* M v' + (D + G) v + K q + R z = Q u,  q' = v + W q; the lower factor L of M = L L^T is stored */
void model_coordinate_rate(const double *q, const double *v, const double *z, const double *u, double *q_rate,
                           double *v_rate)
{
    enum { N = MODEL_COORDINATES };
    int i, j;
    for (i = 0; i < N; i++) {
        q_rate[i] = v[i];
        v_rate[i] = 0.0;
    }
    add_product(N, N, 1.0, model_turning, q, q_rate);
    add_product(N, MODEL_INPUTS, 1.0, model_forces, u, v_rate);
    add_product(N, N, -1.0, model_damping, v, v_rate);
    add_product(N, N, -1.0, model_gyroscopic, v, v_rate);
    add_product(N, N, -1.0, model_stiffness, q, v_rate);
    add_product(N, MODEL_FURTHER, -1.0, model_coupling, z, v_rate);
    for (i = 0; i < N; i++) {
        for (j = 0; j < i; j++)
            v_rate[i] -= model_mass_factor[i * N + j] * v_rate[j];
        v_rate[i] /= model_mass_factor[i * N + i];
    }
    for (i = N - 1; i >= 0; i--) {
        for (j = i + 1; j < N; j++)
            v_rate[i] -= model_mass_factor[j * N + i] * v_rate[j];
        v_rate[i] /= model_mass_factor[i * N + i];
    }
}

/* the same over the modes: q = Phi eta, v = Phi nu, Phi^T M Phi = 1 */
void model_modal_rate(const double *eta, const double *nu, const double *z, const double *u, double *eta_rate,
                      double *nu_rate)
{
    enum { N = MODEL_COORDINATES };
    int i;
    for (i = 0; i < N; i++) {
        eta_rate[i] = nu[i];
        nu_rate[i] = 0.0;
    }
    add_product(N, N, 1.0, model_modal_turning, eta, eta_rate);
    add_product(N, MODEL_INPUTS, 1.0, model_modal_forces, u, nu_rate);
    add_product(N, N, -1.0, model_modal_damping, nu, nu_rate);
    add_product(N, N, -1.0, model_modal_gyroscopic, nu, nu_rate);
    add_product(N, N, -1.0, model_modal_stiffness, eta, nu_rate);
    add_product(N, MODEL_FURTHER, -1.0, model_modal_coupling, z, nu_rate);
}
