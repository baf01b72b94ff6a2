"""The learnt motion prior (Ni 2008, IV): local PCA, hidden Markov model, VQPCA, training."""
