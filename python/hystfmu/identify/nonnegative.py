"""x"""
import numpy as np
from scipy.optimize import nnls
def nonnegative(A,b,F):
    Q,R=np.linalg.qr(F)
    P=A-Q@(Q.T@A); s=np.linalg.norm(P,axis=0); s[s<=1e-12*np.linalg.norm(A,axis=0)]=np.inf
    w,_=nnls(P/s,b-Q@(Q.T@b),maxiter=50*A.shape[1]); w=w/s
    return w, np.linalg.solve(R,Q.T@(b-A@w))
